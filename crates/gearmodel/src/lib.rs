//! gearmodel

//! Codecs of the devices on the rig, without input or output.
//!
//! Everything here turns bytes into messages and back and knows nothing of ports, clocks or tasks, so that the
//! drivers (which ask) and the emulators (which answer) share one implementation, and so that a captured byte
//! stream is a test.
//!
//! | module | device | document |
//! |---|---|---|
//! | [`modbus`] | anything that speaks Modbus RTU | Modbus over Serial Line V1.02, Application Protocol V1.1b3 |
//! | [`register_map`] | registers as data: address, type, word order, scale, unit | |
//! | [`asda_b2`] | Delta ASDA-B2 servo drive | `docs/wire/asda-b2.md` |
//! | [`rd60xx`] | Riden RD60xx current source, the brake's driver | `docs/wire/rd60xx.md` |
//! | [`dsp7000`] | Magtrol DSP7000 dynamometer controller | `docs/wire/dsp7000.md` |
//! | [`qsb`] | US Digital QSB encoder readers | `docs/wire/qsb.md` |
//! | [`counter_box`] | the rig's own two-channel counter box | `docs/wire/counter-box.md` |
//!
//! Whatever reads the encoders gives [`Samples`].

pub mod asda_b2;
pub mod counter_box;
mod device_kind;
pub mod dsp7000;
mod hex;
pub mod modbus;
pub mod qsb;
pub mod rd60xx;
pub mod register_map;
mod samples;

pub use device_kind::DeviceKind;
pub use hex::Hex;
pub use samples::{SampleFlags, Samples};

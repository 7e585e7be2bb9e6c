//! Emulated devices: what the simulated rig answers on its wires.
//!
//! Sans-I/O like the codecs. Whoever owns the ports feeds requests with the simulated time and sends what comes back; the
//! plant stands behind three traits. The emulators answer the real devices' registers and frames, so the drivers are
//! exercised, never bypassed.
//!
//! | file | device | language |
//! |---|---|---|
//! | [`servo`] | Delta ASDA-B2 | Modbus RTU, `docs/wire/asda-b2.md` |
//! | [`brake`] | Riden RD60xx | Modbus RTU, `docs/wire/rd60xx.md` |
//! | [`counter`] | the rig's counter box | `docs/wire/counter-box.md` |
//! | [`qsb`] | a QSB encoder reader | `docs/wire/qsb.md` |
//! | [`mod@line`] | a Modbus line with a device at its end, and the faults a line can have | |

pub mod brake;
pub mod counter;
mod interface;
pub mod line;
mod parameters;
pub mod qsb;
pub mod servo;

pub use brake::BrakeEmulator;
pub use counter::{CounterEmulator, Latched};
pub use interface::{BrakeCoil, EncoderPair, Reply, ServoAxis};
pub use line::{LineFault, ModbusLine, Transmission};
pub use qsb::{QsbClock, QsbEmulator};
pub use servo::ServoEmulator;

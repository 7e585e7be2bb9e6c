//! The service: what the rig is doing, over HTTP, for viewers; and, with a token, stopping, pausing and starting it.
//!
//! It is a process beside the run and reads the log that the run writes: neither its load nor its death reaches the recorder. By default it
//! listens on this machine alone and only shows. [`access`] decides who may do what, [`routes`] answers, [`server`] carries the bytes within
//! limits of size, time and number; [`live`] reads the log, [`control`] does what was asked.
//!
//! | request | answer |
//! |---|---|
//! | `GET /`, `/live.js`, `/live.css` | the page, from within the program: no file of the disk is ever served |
//! | `GET /api/status` | `rigd.status/1`: run, state, losses, latest TE, events |
//! | `GET /api/te?since=N` | `rigd.te/1`: TE points from number N on |
//! | `GET /api/plans` | names of the plans that may be started |
//! | `POST /api/stop`, `/api/pause` | as `rigd stop`; pause at the end of a revolution, or go on |
//! | `POST /api/start` | body `{"plan": "NAME"}` |

pub mod access;
pub mod control;
pub mod limits;
pub mod live;
pub mod routes;
pub mod server;
pub mod tls;

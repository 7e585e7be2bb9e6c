//! `rigd serve`: show what the rig is doing, over HTTP; with a token, control it.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::rc::Rc;

use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tokio::task::LocalSet;

use super::{Exit, fail, print};
use crate::service::access::{Access, AccessError, Token};
use crate::service::control::Control;
use crate::service::routes::Routes;
use crate::service::{live, server, tls};

/// Show what the rig is doing, over HTTP; with a token, control it
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Where to listen; other machines than this one need TLS and a token
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8377")]
    listen: SocketAddr,
    /// Directory of the logs
    #[arg(long, value_name = "DIR", default_value = "runs")]
    out: PathBuf,
    /// File with the token alone in it, readable by its owner alone
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Certificate chain, PEM
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// Its private key, PEM
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Let whoever has the token stop, pause and start; without this the service only shows
    #[arg(long)]
    control: bool,
    /// Directory of the plans that may be started
    #[arg(long, value_name = "DIR", requires = "control")]
    plans: Option<PathBuf>,
    /// The rig that plans are started on
    #[arg(long, value_name = "FILE", requires = "plans")]
    profile: Option<PathBuf>,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    match prepare(args) {
        Ok((access, acceptor)) => serve(args, access, acceptor),
        Err(error) => fail(Exit::BadInput, &error),
    }
}

type Prepared = (Access, Option<tokio_rustls::TlsAcceptor>);

fn prepare(args: &Args) -> Result<Prepared, AccessError> {
    let token = args.token_file.as_deref().map(Token::load).transpose()?;
    let access = Access::new(args.listen, token, args.tls_cert.is_some(), args.control)?;
    let acceptor = match (&args.tls_cert, &args.tls_key) {
        (Some(certificate), Some(key)) => Some(tls::acceptor(certificate, key)?),
        _ => None,
    };
    Ok((access, acceptor))
}

fn serve(args: &Args, access: Access, acceptor: Option<tokio_rustls::TlsAcceptor>) -> Exit {
    let runtime = match tokio::runtime::Builder::new_current_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return fail(Exit::Failed, &error),
    };
    let program = match std::env::current_exe() {
        Ok(program) => program,
        Err(error) => return fail(Exit::Failed, &error),
    };
    let control = Control::new(program, args.plans.clone(), args.out.clone(), args.profile.clone());
    let live = match live::follow(&args.out) {
        Ok(live) => live,
        Err(error) => return fail(Exit::Failed, &error),
    };
    let (exposed, may_control) = (access.exposed, access.control);
    let routes = Rc::new(Routes::new(access, live, control));
    let outcome = LocalSet::new().block_on(&runtime, async {
        let mut interrupted = signal(SignalKind::interrupt())?;
        let mut terminated = signal(SignalKind::terminate())?;
        let listener = TcpListener::bind(args.listen).await?;
        let address = listener.local_addr()?;
        let scheme = if acceptor.is_some() { "https" } else { "http" };
        let who = if exposed { "other machines too, with the token" } else { "this machine alone" };
        let what = if may_control { "shows and, with the token, controls" } else { "shows, read-only" };
        print(&format!("{scheme}://{address}/ for {who}: {what} the newest log in {}", args.out.display()));
        tokio::select! {
            () = server::serve(listener, acceptor, routes) => {}
            _ = interrupted.recv() => {}
            _ = terminated.recv() => {}
        }
        Ok::<_, std::io::Error>(())
    });
    match outcome {
        Ok(()) => Exit::Done,
        Err(error) => {
            eprintln!("error: --listen {}: {error}; choose another port, or end the service that has it", args.listen);
            Exit::Failed
        }
    }
}

//! Carries requests and answers, within limits of size, time and number.

use std::convert::Infallible;
use std::net::IpAddr;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use http_body_util::{BodyExt as _, Limited};
use hyper::Request;
use hyper::body::Incoming;
use hyper::http::StatusCode;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio::time::timeout;
use tokio_rustls::TlsAcceptor;

use super::routes::{Answer, Routes, refusal};

/// Connections at once.
const CONNECTIONS: usize = 64;
/// Longest head of a request, bytes.
const HEAD_BYTES: usize = 16 << 10;
/// Longest body of a request, bytes: the name of a plan.
const BODY_BYTES: usize = 4 << 10;
/// Time for a handshake, for a request's head, and for its body.
const PATIENCE: Duration = Duration::from_secs(5);
/// A connection is closed after this time: a page opens another, who holds on in vain does not.
const LONGEST: Duration = Duration::from_secs(600);

/// Serves until the future is dropped; needs a local task set.
pub async fn serve(listener: TcpListener, tls: Option<TlsAcceptor>, routes: Rc<Routes>) {
    let connections = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        // Whoever comes beyond the limit waits in the kernel's queue.
        let Ok(permit) = Arc::clone(&connections).acquire_owned().await else { return };
        let (stream, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                // Out of file descriptors, or a peer that has gone already: either passes.
                tracing::warn!("a connection was not accepted: {error}");
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        let (tls, routes) = (tls.clone(), Rc::clone(&routes));
        tokio::task::spawn_local(async move {
            let _permit = permit;
            // Answers are small; waiting for more of them helps nobody.
            let _ = stream.set_nodelay(true);
            let served = async {
                match tls {
                    None => connection(stream, peer.ip(), routes).await,
                    Some(tls) => match timeout(PATIENCE, tls.accept(stream)).await {
                        Ok(Ok(stream)) => connection(stream, peer.ip(), routes).await,
                        Ok(Err(error)) => tracing::debug!("{peer}: no TLS: {error}"),
                        Err(_) => tracing::debug!("{peer}: no TLS in time"),
                    },
                }
            };
            if timeout(LONGEST, served).await.is_err() {
                tracing::debug!("{peer}: connection closed after {} s", LONGEST.as_secs());
            }
        });
    }
}

async fn connection(stream: impl AsyncRead + AsyncWrite + Unpin, peer: IpAddr, routes: Rc<Routes>) {
    let service = service_fn(move |request| {
        let routes = Rc::clone(&routes);
        async move { Ok::<_, Infallible>(exchange(&routes, peer, request).await) }
    });
    let served = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(PATIENCE)
        .max_buf_size(HEAD_BYTES)
        .serve_connection(TokioIo::new(stream), service)
        .await;
    if let Err(error) = served {
        tracing::debug!("{peer}: {error}");
    }
}

async fn exchange(routes: &Routes, peer: IpAddr, request: Request<Incoming>) -> Answer {
    let (head, body) = request.into_parts();
    // Before the body: whoever may not ask is not listened to.
    if let Err(answer) = routes.admit(peer, &head) {
        return *answer;
    }
    // The path alone: no header is ever written to a log, for one of them is the token.
    tracing::debug!("{peer} {} {}", head.method, head.uri.path());
    match timeout(PATIENCE, Limited::new(body, BODY_BYTES).collect()).await {
        Ok(Ok(body)) => routes.answer(&head, &body.to_bytes()),
        Ok(Err(_)) => refusal(StatusCode::PAYLOAD_TOO_LARGE, "a body has at most 4096 bytes"),
        Err(_) => refusal(StatusCode::REQUEST_TIMEOUT, "the body did not come in time"),
    }
}

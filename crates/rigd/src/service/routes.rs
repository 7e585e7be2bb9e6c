//! What is answered to a request. No socket here: a request is a value, and so is its answer.

use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use http_body_util::Full;
use hyper::Response;
use hyper::body::Bytes;
use hyper::http::request::Parts;
use hyper::http::{HeaderValue, Method, StatusCode, header};
use serde::Deserialize;
use serde_json::{Value, json};

use super::access::{Access, Verdict, is_local_host};
use super::control::{Control, ControlError};
use super::limits::{Limiter, REQUESTS, WRONG_TOKENS};
use super::live::Shared;

/// An answer with all of its body.
pub type Answer = Response<Full<Bytes>>;

const PAGE: &str = include_str!("page/live.html");
const SCRIPT: &str = include_str!("page/live.js");
const STYLE: &str = include_str!("page/live.css");

/// Pages load nothing from elsewhere and run no script but their own.
const CONTENT_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What answers.
pub struct Routes {
    access: Access,
    live: Shared,
    control: Control,
    requests: Mutex<Limiter>,
    wrong_tokens: Mutex<Limiter>,
}

/// The body of `POST /api/start`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Start {
    plan: String,
}

impl Routes {
    /// Answers by these rules from these values.
    #[must_use]
    pub fn new(access: Access, live: Shared, control: Control) -> Self {
        let limiter = |rate| Mutex::new(Limiter::new(rate));
        Self { access, live, control, requests: limiter(REQUESTS), wrong_tokens: limiter(WRONG_TOKENS) }
    }

    /// Whether `peer` may ask at all; before its body is read.
    ///
    /// # Errors
    /// The answer that it gets instead.
    pub fn admit(&self, peer: IpAddr, request: &Parts) -> Result<(), Box<Answer>> {
        let now = Instant::now();
        if let Err(wait) = self.requests.lock().unwrap_or_else(PoisonError::into_inner).ask(peer, now, true) {
            return Err(Box::new(later(wait, "too many requests")));
        }
        // One header, or none: of two, which one counts would be a guess.
        let mut hosts = request.headers.get_all(header::HOST).iter();
        let host = hosts.next().and_then(|host| host.to_str().ok()).unwrap_or_default();
        if hosts.next().is_some() || (!self.access.exposed && !is_local_host(host)) {
            return Err(Box::new(refusal(
                StatusCode::MISDIRECTED_REQUEST,
                "this service is asked as localhost or 127.0.0.1",
            )));
        }
        let page = !request.uri.path().starts_with("/api/");
        if page {
            // The page holds nothing of the rig; it asks for the token itself.
            return Ok(());
        }
        let mut wrong = self.wrong_tokens.lock().unwrap_or_else(PoisonError::into_inner);
        let offered = bearer(request);
        // Whoever has guessed too often is not even told whether this one was right.
        if offered.is_some()
            && let Err(wait) = wrong.ask(peer, now, false)
        {
            return Err(Box::new(later(wait, "too many wrong tokens")));
        }
        match self.access.judge(changes(&request.method), offered) {
            Verdict::Allowed => Ok(()),
            Verdict::ReadOnly => Err(Box::new(refusal(
                StatusCode::FORBIDDEN,
                "this service is read-only; start it with --control and --token-file",
            ))),
            Verdict::NoToken => Err(Box::new(unauthorized("a token is needed: Authorization: Bearer TOKEN"))),
            Verdict::WrongToken => {
                let _ = wrong.ask(peer, now, true);
                tracing::warn!("{peer} offered a wrong token");
                Err(Box::new(unauthorized("wrong token")))
            }
        }
    }

    /// The answer to a request that was admitted.
    #[must_use]
    pub fn answer(&self, request: &Parts, body: &[u8]) -> Answer {
        let path = request.uri.path();
        match (&request.method, path) {
            (&Method::GET | &Method::HEAD, "/") => text("text/html; charset=utf-8", PAGE),
            (&Method::GET | &Method::HEAD, "/live.js") => text("text/javascript; charset=utf-8", SCRIPT),
            (&Method::GET | &Method::HEAD, "/live.css") => text("text/css; charset=utf-8", STYLE),
            (&Method::GET, "/api/status") => {
                let mut status = self.live.lock().status();
                status["control"] = json!(self.access.control);
                status["plan"] = self.control.started();
                object(StatusCode::OK, &status)
            }
            (&Method::GET, "/api/te") => match since(request.uri.query().unwrap_or_default()) {
                Some(since) => object(StatusCode::OK, &self.live.lock().points(since)),
                None => refusal(StatusCode::BAD_REQUEST, "ask for /api/te?since=N with a whole number N"),
            },
            (&Method::GET, "/api/plans") => object(StatusCode::OK, &json!({"plans": self.control.plans()})),
            (&Method::POST, "/api/stop") => done("stop", self.control.stop()),
            (&Method::POST, "/api/pause") => done("pause", self.control.pause()),
            (&Method::POST, "/api/start") => match serde_json::from_slice::<Start>(body) {
                Ok(start) => done("start", self.control.start(&start.plan)),
                Err(_) => refusal(StatusCode::BAD_REQUEST, "the body is {\"plan\": \"NAME\"}"),
            },
            (_, "/" | "/live.js" | "/live.css" | "/api/status" | "/api/te" | "/api/plans") => {
                refusal(StatusCode::METHOD_NOT_ALLOWED, "this can only be read")
            }
            (_, "/api/stop" | "/api/pause" | "/api/start") => {
                refusal(StatusCode::METHOD_NOT_ALLOWED, "this is asked for with POST")
            }
            _ => refusal(StatusCode::NOT_FOUND, "there is nothing here"),
        }
    }
}

/// Whether a method may change something.
fn changes(method: &Method) -> bool {
    !matches!(*method, Method::GET | Method::HEAD)
}

fn bearer(request: &Parts) -> Option<&str> {
    let value = request.headers.get(header::AUTHORIZATION)?;
    // What is no text, or no bearer's, is a wrong token.
    Some(value.to_str().ok().and_then(|text| text.strip_prefix("Bearer ")).map_or("", str::trim))
}

fn since(query: &str) -> Option<u64> {
    match query {
        "" => Some(0),
        query => query.strip_prefix("since=")?.parse().ok(),
    }
}

fn done(what: &str, outcome: Result<Value, ControlError>) -> Answer {
    match outcome {
        Ok(told) => {
            tracing::warn!("{what}: {told}");
            object(StatusCode::OK, &told)
        }
        Err(error @ ControlError::UnknownPlan) => refusal(StatusCode::NOT_FOUND, &error.to_string()),
        Err(error @ ControlError::Start(_)) => refusal(StatusCode::INTERNAL_SERVER_ERROR, &error.to_string()),
        Err(error) => refusal(StatusCode::CONFLICT, &error.to_string()),
    }
}

fn response(status: StatusCode, kind: &'static str, body: Bytes) -> Answer {
    let mut response = Response::new(Full::new(body));
    *response.status_mut() = status;
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_TYPE, kind),
        (header::CACHE_CONTROL, "no-store"),
        (header::CONTENT_SECURITY_POLICY, CONTENT_POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

fn text(kind: &'static str, text: &'static str) -> Answer {
    response(StatusCode::OK, kind, Bytes::from_static(text.as_bytes()))
}

fn object(status: StatusCode, value: &Value) -> Answer {
    response(status, "application/json", Bytes::from(value.to_string()))
}

/// A refusal as the page and scripts read it.
pub fn refusal(status: StatusCode, why: &str) -> Answer {
    object(status, &json!({"error": why}))
}

fn unauthorized(why: &str) -> Answer {
    let mut answer = refusal(StatusCode::UNAUTHORIZED, why);
    answer.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    answer
}

fn later(wait: std::time::Duration, why: &str) -> Answer {
    let mut answer = refusal(StatusCode::TOO_MANY_REQUESTS, why);
    answer.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(wait.as_secs() + 1));
    answer
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::access::Token;
    use http_body_util::BodyExt as _;
    use hyper::Request;

    const TOKEN: &str = "0123456789abcdef-secret";
    const PEER: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);

    fn routes(token: bool, control: bool) -> Routes {
        let access =
            Access::new("127.0.0.1:1".parse().unwrap(), token.then(|| Token::of(TOKEN)), false, control).unwrap();
        Routes::new(access, Shared::default(), Control::new("/bin/true".into(), None, ".".into(), None))
    }

    fn ask(routes: &Routes, method: &str, path: &str, token: Option<&str>, body: &[u8]) -> (u16, String) {
        let mut request = Request::builder().method(method).uri(path).header("host", "localhost:8377");
        if let Some(token) = token {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        let (parts, ()) = request.body(()).unwrap().into_parts();
        let answer = match routes.admit(PEER, &parts) {
            Ok(()) => routes.answer(&parts, body),
            Err(answer) => *answer,
        };
        let status = answer.status().as_u16();
        assert_eq!(answer.headers()["x-content-type-options"], "nosniff");
        let bytes = futures_ready(answer.into_body().collect()).unwrap().to_bytes();
        (status, String::from_utf8(bytes.to_vec()).unwrap())
    }

    /// A body that is all there needs no runtime.
    fn futures_ready<F: Future>(future: F) -> F::Output {
        let mut future = std::pin::pin!(future);
        let mut context = std::task::Context::from_waker(std::task::Waker::noop());
        match future.as_mut().poll(&mut context) {
            std::task::Poll::Ready(output) => output,
            std::task::Poll::Pending => panic!("the body is all there"),
        }
    }

    #[test]
    fn a_viewer_reads_and_changes_nothing() {
        let routes = routes(false, false);
        for path in ["/", "/live.js", "/live.css", "/api/status", "/api/te?since=3", "/api/te", "/api/plans"] {
            assert_eq!(ask(&routes, "GET", path, None, b"").0, 200, "{path}");
        }
        for path in ["/api/stop", "/api/pause", "/api/start", "/api/status"] {
            for method in ["POST", "PUT", "DELETE", "PATCH"] {
                assert_eq!(ask(&routes, method, path, None, b"{}").0, 403, "{method} {path}");
            }
        }
        assert_eq!(ask(&routes, "GET", "/api/stop", None, b"").0, 405);
        assert_eq!(ask(&routes, "GET", "/api/te?since=-1", None, b"").0, 400);
    }

    #[test]
    fn no_path_leads_to_a_file() {
        let routes = routes(false, false);
        for path in [
            "/../etc/passwd",
            "/..%2f..%2fetc/passwd",
            "//etc/passwd",
            "/./",
            "/live.js/..",
            "/api/../",
            "/%2e%2e/",
            "/runs/a.mcap",
            "/api/status/",
            "/token",
            "/LIVE.JS",
        ] {
            let (status, body) = ask(&routes, "GET", path, None, b"");
            assert_eq!(status, 404, "{path}");
            assert!(!body.contains("root:"), "{body}");
        }
    }

    #[test]
    fn control_wants_the_token_and_does_not_let_it_be_guessed() {
        let routes = routes(true, true);
        assert_eq!(ask(&routes, "POST", "/api/pause", None, b"").0, 401);
        assert_eq!(ask(&routes, "POST", "/api/start", Some(TOKEN), b"{\"plan\": \"x\"}").0, 409, "no plans");
        assert_eq!(ask(&routes, "POST", "/api/start", Some(TOKEN), b"{\"plan\": 7}").0, 400);
        assert_eq!(ask(&routes, "POST", "/api/start", Some(TOKEN), b"{\"plan\": \"x\", \"and\": 1}").0, 400);
        for guess in 0..5 {
            assert_eq!(ask(&routes, "POST", "/api/stop", Some(&format!("guess {guess}")), b"").0, 401);
        }
        assert_eq!(ask(&routes, "POST", "/api/stop", Some("guess"), b"").0, 429);
        assert_eq!(ask(&routes, "POST", "/api/stop", Some(TOKEN), b"").0, 429, "nor is the right one confirmed");
        assert_eq!(ask(&routes, "GET", "/api/status", None, b"").0, 200, "viewers are not locked out");
    }

    #[test]
    fn a_flood_is_answered_with_wait() {
        let routes = routes(false, false);
        let statuses: Vec<u16> = (0..400).map(|_| ask(&routes, "GET", "/api/te", None, b"").0).collect();
        assert!(statuses[..200].iter().all(|status| *status == 200));
        assert!(statuses.iter().filter(|status| **status == 429).count() > 100);
    }

    #[test]
    fn pages_of_other_sites_are_refused_whatever_their_name_resolves_to() {
        let routes = routes(false, false);
        for host in [&["evil.example:8377"][..], &[""], &["localhost", "evil.example"]] {
            let mut request = Request::builder().uri("/api/status");
            for host in host {
                request = request.header("host", *host);
            }
            let (parts, ()) = request.body(()).unwrap().into_parts();
            assert_eq!(routes.admit(PEER, &parts).unwrap_err().status().as_u16(), 421, "{host:?}");
        }
    }
}

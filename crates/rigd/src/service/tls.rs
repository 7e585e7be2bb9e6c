//! Certificate and key of the service.

use std::path::Path;
use std::sync::Arc;

use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::crypto::ring::default_provider;
use tokio_rustls::rustls::pki_types::pem::PemObject as _;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};

use super::access::AccessError;

/// TLS 1.3 with this certificate chain and key, both PEM files.
///
/// # Errors
/// [`AccessError::Tls`] names the file and what is wrong with it.
pub fn acceptor(certificate: &Path, key: &Path) -> Result<TlsAcceptor, AccessError> {
    let refuse = |option, path: &Path, reason: String| AccessError::Tls { option, path: path.into(), reason };
    let at_certificate = |reason: String| refuse("--tls-cert", certificate, reason);
    let at_key = |reason: String| refuse("--tls-key", key, reason);
    let chain: Vec<CertificateDer<'static>> = CertificateDer::pem_file_iter(certificate)
        .and_then(Iterator::collect)
        .map_err(|error| at_certificate(error.to_string()))?;
    if chain.is_empty() {
        return Err(at_certificate("no certificate in it".into()));
    }
    let secret = PrivateKeyDer::from_pem_file(key).map_err(|error| at_key(error.to_string()))?;
    let config = ServerConfig::builder_with_provider(Arc::new(default_provider()))
        .with_protocol_versions(&[&tokio_rustls::rustls::version::TLS13])
        .and_then(|builder| builder.with_no_client_auth().with_single_cert(chain, secret))
        .map_err(|error| at_key(error.to_string()))?;
    Ok(TlsAcceptor::from(Arc::new(config)))
}

//! Checks the host and the origin of a request before its other parts are read. So neither a page
//! of another site, nor a foreign host name that points to this machine, receives an answer.

use hyper::header::{HeaderMap, HeaderName, HeaderValue, ORIGIN};
use hyper::{Method, Uri};

use rungd_net::http::ExpectedHosts;

/// The header with the session's token. Each change must have it.
pub(super) const CSRF: &str = "x-csrf-token";

/// The headers of every answer.
const SECURITY: [(&str, &str); 8] = [
    (
        "content-security-policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; \
         connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    ),
    ("x-content-type-options", "nosniff"),
    ("x-frame-options", "DENY"),
    ("referrer-policy", "no-referrer"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-resource-policy", "same-origin"),
    ("permissions-policy", "camera=(), geolocation=(), microphone=()"),
    ("cache-control", "no-store"),
];

/// The requests that are admitted.
#[derive(Clone, Debug)]
pub(super) struct RequestGuard {
    /// The accepted values of `Host`.
    hosts: ExpectedHosts,
    /// Whether browsers speak TLS.
    is_tls: bool,
}

impl RequestGuard {
    /// `hosts`: the accepted values of `Host`, in small letters.
    pub fn new(hosts: Vec<String>, is_tls: bool) -> RequestGuard {
        RequestGuard { hosts: ExpectedHosts::new(hosts, "rungd web --host NAME"), is_tls }
    }

    /// Admits a request of our own pages.
    ///
    /// # Errors
    /// Why it is not admitted.
    pub fn admit(&self, method: &Method, uri: &Uri, headers: &HeaderMap) -> Result<(), String> {
        let host = self.hosts.host(uri, headers)?;
        let mut origins = headers.get_all(ORIGIN).iter();
        match (origins.next(), origins.next()) {
            (None, _) if *method == Method::GET || *method == Method::HEAD => Ok(()),
            (None, _) => Err("a change needs an Origin header".to_owned()),
            (Some(_), Some(_)) => Err("a request must have exactly one Origin header".to_owned()),
            (Some(origin), None) => {
                let scheme = if self.is_tls { "https" } else { "http" };
                let own = format!("{scheme}://{host}");
                let said = origin.to_str().unwrap_or_default();
                if said.eq_ignore_ascii_case(&own) {
                    return Ok(());
                }
                Err("the request comes from a page of another site (its Origin)".to_owned())
            }
        }
    }
}

/// Adds the security headers, which every answer has.
pub(super) fn secure(headers: &mut HeaderMap) {
    for (name, value) in SECURITY {
        headers.insert(HeaderName::from_static(name), HeaderValue::from_static(value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn admit(method: Method, uri: &str, headers: &[(&str, &str)]) -> Result<(), String> {
        let guard = RequestGuard::new(vec!["localhost:8080".into(), "plc.example".into()], false);
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            let name: HeaderName = name.parse().expect("a name");
            map.append(name, HeaderValue::from_str(value).expect("a value"));
        }
        guard.admit(&method, &uri.parse().expect("a target"), &map)
    }

    #[test]
    fn only_requests_for_own_hosts_and_from_own_pages_are_answered() {
        let own = ("host", "localhost:8080");
        assert!(admit(Method::GET, "/", &[own]).is_ok());
        assert!(admit(Method::GET, "/", &[("host", "PLC.example")]).is_ok());
        let from = |origin| admit(Method::POST, "/api/write", &[own, ("origin", origin)]);
        assert!(from("http://localhost:8080").is_ok());
        for origin in ["null", "http://evil.example", "https://localhost:8080", ""] {
            assert!(from(origin).is_err(), "{origin}");
        }
        let get = |headers: &[_]| admit(Method::GET, "/", headers);
        assert!(get(&[]).is_err());
        assert!(get(&[("host", "evil.example")]).is_err());
        assert!(get(&[own, own]).is_err());
        assert!(get(&[own, ("origin", "http://evil.example")]).is_err());
        assert!(admit(Method::POST, "/api/write", &[own]).is_err(), "a form of another site");
        assert!(admit(Method::GET, "http://evil.example/", &[own]).is_err());
    }
}

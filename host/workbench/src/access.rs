//! Who may ask: this machine's browser, on a page that was opened with the token.

use axum::http::{header, HeaderMap, Uri};
use rand::TryRngCore;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use yawrig_base::error::{Error, Result};

/// What a request must show.
#[derive(Clone, Debug)]
pub struct Access {
    /// 128 random bits in hexadecimal digits.
    pub token: String,
    pub address: SocketAddr,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Another name than that of this page: a foreign site whose name resolves to this machine (DNS
    /// rebinding).
    Host,
    /// Sent by the page of another site.
    Origin,
    Token,
}

impl Refusal {
    pub fn text(self) -> &'static str {
        match self {
            Self::Host => "403: this page answers to its own address only. Open the address that yawrig printed.\n",
            Self::Origin => "403: asked for by a page of another site.\n",
            Self::Token => "403: the token is missing or not the one of this run. Open the address that yawrig printed.\n",
        }
    }
}

impl Access {
    /// A fresh token for a page at `address`.
    ///
    /// # Errors
    /// Where the system has no random numbers.
    pub fn new(address: SocketAddr) -> Result<Self> {
        let mut bytes = [0; 16];
        rand::rngs::OsRng
            .try_fill_bytes(&mut bytes)
            .map_err(|e| Error::internal(format!("no random numbers for the page's token: {e}")))?;
        Ok(Self { token: bytes.iter().map(|b| format!("{b:02x}")).collect(), address })
    }

    /// The address to open.
    pub fn url(&self) -> String {
        let host = match self.address.ip() {
            ip if ip.is_unspecified() => {
                SocketAddr::new(Ipv4Addr::LOCALHOST.into(), self.address.port())
            }
            ip => SocketAddr::new(ip, self.address.port()),
        };
        format!("http://{host}/?token={}", self.token)
    }

    /// Cookies are not kept apart by port: each workbench has its own.
    pub fn cookie_name(&self) -> String {
        format!("yawrig-{}", self.address.port())
    }

    /// `Set-Cookie` with the token.
    pub fn cookie(&self) -> String {
        format!("{}={}; Path=/; HttpOnly; SameSite=Strict", self.cookie_name(), self.token)
    }

    /// Whether `query` of a page's address carries the token.
    pub fn opens(&self, uri: &Uri) -> bool {
        let pairs = uri.query().unwrap_or("").split('&');
        pairs.filter_map(|pair| pair.strip_prefix("token=")).any(|token| self.is_token(token))
    }

    /// # Errors
    /// What is wrong with the request.
    pub fn check(&self, headers: &HeaderMap, uri: &Uri) -> std::result::Result<(), Refusal> {
        let text = |name| headers.get(name).and_then(|v| v.to_str().ok());
        if !text(header::HOST).is_some_and(|host| self.is_here(host)) {
            return Err(Refusal::Host);
        }
        if let Some(origin) = headers.get(header::ORIGIN) {
            let origin = origin.to_str().unwrap_or("");
            if !origin.strip_prefix("http://").is_some_and(|host| self.is_here(host)) {
                return Err(Refusal::Origin);
            }
        }
        // Said by the browser itself: a link on another site is fine where it carries the token, a form is
        // not.
        let site = headers.get("sec-fetch-site").and_then(|v| v.to_str().ok());
        let is_foreign = matches!(site, Some("cross-site" | "same-site"));
        if is_foreign && !self.opens(uri) {
            return Err(Refusal::Origin);
        }
        let name = self.cookie_name();
        let cookies = headers.get_all(header::COOKIE).iter().filter_map(|v| v.to_str().ok());
        let in_cookie = cookies
            .flat_map(|line| line.split(';'))
            .filter_map(|cookie| cookie.trim().split_once('='))
            .any(|(key, value)| key == name && self.is_token(value));
        let in_header = text(header::AUTHORIZATION)
            .and_then(|v| v.strip_prefix("Bearer "))
            .is_some_and(|token| self.is_token(token));
        if in_cookie || in_header || self.opens(uri) {
            Ok(())
        } else {
            Err(Refusal::Token)
        }
    }

    /// Constant time, so that timing reveals nothing of the token.
    fn is_token(&self, given: &str) -> bool {
        given.len() == self.token.len()
            && given.bytes().zip(self.token.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b)) == 0
    }

    /// Whether `host` (with its port) is this page's own. Only a numeric address is: a name may be
    /// made to resolve to this machine.
    fn is_here(&self, host: &str) -> bool {
        let port = self.address.port();
        if host == format!("localhost:{port}") {
            return self.address.ip().is_loopback();
        }
        let with_port = host.parse::<SocketAddr>().ok();
        // A browser leaves port 80 out.
        let bare = || {
            host.trim_matches(['[', ']']).parse::<IpAddr>().ok().map(|ip| SocketAddr::new(ip, 80))
        };
        with_port.or_else(bare).is_some_and(|asked| {
            asked.port() == port
                && (asked.ip() == self.address.ip() || self.address.ip().is_unspecified())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn access(address: &str) -> Access {
        Access::new(address.parse().unwrap()).unwrap()
    }

    fn checked(access: &Access, pairs: &[(&'static str, &str)], uri: &str) -> Option<Refusal> {
        let mut headers = HeaderMap::new();
        for (name, value) in pairs {
            headers.append(*name, HeaderValue::from_str(value).unwrap());
        }
        access.check(&headers, &uri.parse().unwrap()).err()
    }

    #[test]
    fn host_origin_and_token_must_all_be_right() {
        let a = access("127.0.0.1:4000");
        let good = format!("yawrig-4000={}", a.token);
        let bearer = format!("Bearer {}", a.token);
        let cookie = ("cookie", good.as_str());
        let host = ("host", "127.0.0.1:4000");
        assert_eq!(checked(&a, &[host, cookie], "/"), None);
        assert_eq!(checked(&a, &[("host", "localhost:4000"), cookie], "/"), None);
        assert_eq!(checked(&a, &[host, ("authorization", &bearer)], "/"), None);
        assert_eq!(checked(&a, &[host], &format!("/?token={}", a.token)), None);
        assert_eq!(checked(&a, &[host, ("origin", "http://127.0.0.1:4000"), cookie], "/"), None);
        for wrong in ["evil.example:4000", "127.0.0.1:4001", "127.0.0.1", "10.0.0.1:4000", ""] {
            assert_eq!(
                checked(&a, &[("host", wrong), cookie], "/"),
                Some(Refusal::Host),
                "{wrong}"
            );
        }
        assert_eq!(checked(&a, &[cookie], "/"), Some(Refusal::Host));
        for wrong in
            ["http://evil.example", "null", "https://127.0.0.1:4000", "http://127.0.0.1:80"]
        {
            assert_eq!(
                checked(&a, &[host, ("origin", wrong), cookie], "/"),
                Some(Refusal::Origin),
                "{wrong}"
            );
        }
        let foreign = ("sec-fetch-site", "cross-site");
        assert_eq!(checked(&a, &[host, foreign, cookie], "/"), Some(Refusal::Origin));
        assert_eq!(checked(&a, &[host, foreign], &format!("/?token={}", a.token)), None);
        let other = access("127.0.0.1:4000").token;
        let wrong = format!("yawrig-4000={other}");
        let elsewhere = good.replace("4000", "4001");
        for wrong in [wrong.as_str(), elsewhere.as_str(), "yawrig-4000=", ""] {
            assert_eq!(
                checked(&a, &[host, ("cookie", wrong)], "/"),
                Some(Refusal::Token),
                "{wrong}"
            );
        }
        assert_eq!(checked(&a, &[host], "/?token=abc"), Some(Refusal::Token));
    }

    #[test]
    fn with_all_addresses_allowed_names_still_are_not() {
        let a = access("0.0.0.0:4000");
        let bearer = format!("Bearer {}", a.token);
        let token = ("authorization", bearer.as_str());
        assert_eq!(checked(&a, &[("host", "192.168.1.7:4000"), token], "/"), None);
        assert_eq!(checked(&a, &[("host", "evil.example:4000"), token], "/"), Some(Refusal::Host));
        assert!(a.url().starts_with("http://127.0.0.1:4000/?token="));
        assert_ne!(a.token, access("0.0.0.0:4000").token);
    }
}

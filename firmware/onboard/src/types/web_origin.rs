//! The origin of a web page (RFC 6454): what a browser says of itself when a page opens a connection.

use std::fmt;
use std::net::{Ipv4Addr, Ipv6Addr};
use std::str::FromStr;

/// Where a web page comes from: scheme, host and port, as in `https://viewer.example:8443`, in lower case and
/// without the scheme's usual port.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WebOrigin {
    scheme: String,
    host: String,
    port: Option<u16>,
}

/// Words that are no origin of a web page.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("expected where a web page comes from, such as https://viewer.example, found {found:?}")]
pub struct InvalidOrigin {
    /// What was given.
    pub found: String,
}

impl WebOrigin {
    /// Whether the page was served by the viewer's own machine.
    #[must_use]
    pub fn is_loopback(&self) -> bool {
        is_loopback_host(&self.host)
    }
}

/// Whether a host's name can only mean the machine that asks: `localhost` and names below it (RFC 6761), and
/// the loopback addresses. A name that the outside world's name service answers for is none, whatever it
/// answers.
pub(crate) fn is_loopback_host(host: &str) -> bool {
    let host = host.to_ascii_lowercase();
    let address = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    match address {
        Some(address) => address.parse().is_ok_and(|address: Ipv6Addr| address.is_loopback()),
        None if host == "localhost" || host.ends_with(".localhost") => true,
        None => host.parse().is_ok_and(|address: Ipv4Addr| address.is_loopback()),
    }
}

/// The host and the port of `host`, `host:port`, `[address]` or `[address]:port`.
pub(crate) fn split_port(authority: &str) -> Option<(&str, Option<u16>)> {
    let after_host = match authority.find(']') {
        Some(bracket) if authority.starts_with('[') => bracket + 1,
        Some(_) => return None,
        None => authority.find(':').unwrap_or(authority.len()),
    };
    let (host, rest) = authority.split_at(after_host);
    let port = match rest.strip_prefix(':') {
        Some(port) => Some(port.parse().ok()?),
        None if rest.is_empty() => None,
        None => return None,
    };
    (!host.is_empty()).then_some((host, port))
}

impl FromStr for WebOrigin {
    type Err = InvalidOrigin;

    fn from_str(text: &str) -> Result<Self, InvalidOrigin> {
        let error = || InvalidOrigin { found: text.to_owned() };
        let (scheme, rest) = text.split_once("://").ok_or_else(error)?;
        let scheme = scheme.to_ascii_lowercase();
        let usual_port = match scheme.as_str() {
            "http" => 80,
            "https" => 443,
            _ => return Err(error()),
        };
        let (host, port) = split_port(rest.strip_suffix('/').unwrap_or(rest)).ok_or_else(error)?;
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-._[]:".contains(c);
        if !host.chars().all(is_plain) {
            return Err(error());
        }
        let port = port.filter(|port| *port != usual_port);
        Ok(Self { scheme, host: host.to_ascii_lowercase(), port })
    }
}

impl fmt::Display for WebOrigin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}://{}", self.scheme, self.host)?;
        self.port.map_or(Ok(()), |port| write!(f, ":{port}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_origin_in_other_letters_or_with_the_usual_port_is_the_same() {
        let table = [
            ("https://Viewer.Example", "https://viewer.example"),
            ("HTTPS://viewer.example:443/", "https://viewer.example"),
            ("http://viewer.example:443", "http://viewer.example:443"),
            ("http://[::1]:8080", "http://[::1]:8080"),
            ("http://10.0.0.5:80", "http://10.0.0.5"),
        ];
        for (text, meant) in table {
            assert_eq!(text.parse::<WebOrigin>().unwrap().to_string(), meant, "{text}");
        }
        for text in [
            "",
            "null",
            "*",
            "viewer.example",
            "ftp://a.b",
            "https://",
            "https://a b",
            "https://a/b",
            "http://a:x",
        ] {
            assert!(text.parse::<WebOrigin>().unwrap_err().to_string().contains(text), "{text}");
        }
    }

    #[test]
    fn only_names_that_no_name_service_answers_for_mean_this_machine() {
        for host in ["localhost", "LOCALHOST", "app.localhost", "127.0.0.1", "127.9.9.9", "[::1]"] {
            assert!(is_loopback_host(host), "{host}");
        }
        for host in [
            "",
            "localhost.evil.example",
            "127.0.0.1.evil.example",
            "10.0.0.5",
            "[::2]",
            "::1",
            "0.0.0.0",
            "robot",
        ] {
            assert!(!is_loopback_host(host), "{host}");
        }
    }
}

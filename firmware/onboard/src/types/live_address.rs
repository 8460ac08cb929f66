//! Where a live view is served: an address and a port, this machine alone unless told otherwise.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::str::FromStr;

/// The port that Foxglove and Lichtblick suggest.
const PORT: u16 = 8765;

/// Where a live view is served.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct LiveAddress(SocketAddr);

/// Words that are no address.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "expected an IP address, a port or both, such as 127.0.0.1:8765, 9000 or 0.0.0.0, found \"{found}\" (a file after --live? then --live=ADDR)"
)]
pub struct InvalidAddress {
    /// What was given.
    pub found: String,
}

impl LiveAddress {
    /// The address.
    #[must_use]
    pub const fn socket(self) -> SocketAddr {
        self.0
    }

    /// Whether nobody outside this machine can reach it.
    #[must_use]
    pub const fn is_private(self) -> bool {
        self.0.ip().is_loopback()
    }
}

impl Default for LiveAddress {
    /// This machine alone, the usual port.
    fn default() -> Self {
        Self(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), PORT))
    }
}

impl FromStr for LiveAddress {
    type Err = InvalidAddress;

    fn from_str(text: &str) -> Result<Self, InvalidAddress> {
        let usual = Self::default().0;
        let named = text.strip_prefix("localhost").map(|rest| format!("{}{rest}", usual.ip()));
        let words = named.as_deref().unwrap_or(text);
        let port = words.strip_prefix(':').unwrap_or(words);
        if let Ok(socket) = words.parse() {
            Ok(Self(socket))
        } else if let Ok(ip) = words.trim_start_matches('[').trim_end_matches(']').parse() {
            Ok(Self(SocketAddr::new(ip, usual.port())))
        } else if let Ok(port) = port.parse() {
            Ok(Self(SocketAddr::new(usual.ip(), port)))
        } else {
            Err(InvalidAddress { found: text.to_owned() })
        }
    }
}

impl std::fmt::Display for LiveAddress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_a_port_or_both_and_this_machine_alone_unless_told() {
        let table = [
            ("127.0.0.1:8765", "127.0.0.1:8765", true),
            ("localhost", "127.0.0.1:8765", true),
            ("localhost:9000", "127.0.0.1:9000", true),
            ("9000", "127.0.0.1:9000", true),
            (":9000", "127.0.0.1:9000", true),
            ("0.0.0.0", "0.0.0.0:8765", false),
            ("192.168.1.7:80", "192.168.1.7:80", false),
            ("::1", "[::1]:8765", true),
            ("[::]:9000", "[::]:9000", false),
        ];
        for (text, address, is_private) in table {
            let parsed: LiveAddress = text.parse().unwrap();
            assert_eq!((parsed.to_string().as_str(), parsed.is_private()), (address, is_private), "{text}");
        }
        for text in ["", "run.mcap", "robot.local", "70000", "127.0.0.1:", "1.2.3.4.5"] {
            assert!(text.parse::<LiveAddress>().unwrap_err().to_string().contains(text), "{text}");
        }
    }
}

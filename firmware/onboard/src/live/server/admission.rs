//! Who is let in: programs, and pages of web viewers that the robot's people have named.
//!
//! A browser opens a WebSocket for any page that asks, also to this machine or through a tunnel. It says
//! which page asked (`Origin`), and no page can make it lie. Without a look at it every page that is open in
//! the viewer's browser could read the building (cross-site WebSocket hijacking). A page can also let its own
//! name mean 127.0.0.1 (DNS rebinding): then `Host` has that name.

use tungstenite::http::header::{HOST, ORIGIN};
use tungstenite::http::{HeaderMap, StatusCode};

use crate::types::web_origin::{WebOrigin, is_loopback_host, split_port};

/// Who may look.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Admission {
    /// Web pages that may, beside those that the viewer's own machine serves.
    pub allowed_origins: Vec<WebOrigin>,
    /// Whether the address is one that only this machine can reach, or a tunnel to it.
    pub is_private: bool,
}

/// Why somebody is not let in.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Refusal {
    /// The status of the answer.
    pub status: StatusCode,
    /// A sentence for whoever reads the answer or the log.
    pub words: String,
}

impl Admission {
    /// Whether a request with these headers is let in.
    ///
    /// # Errors
    /// Why not.
    pub(crate) fn check(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let forbidden = |words| Refusal { status: StatusCode::FORBIDDEN, words };
        self.check_host(headers).map_err(forbidden)?;
        // More than one is no browser's doing; none of them may be a stranger's.
        headers.get_all(ORIGIN).iter().try_for_each(|origin| {
            let origin = String::from_utf8_lossy(origin.as_bytes());
            self.check_origin(&origin).map_err(forbidden)
        })
    }

    fn check_host(&self, headers: &HeaderMap) -> Result<(), String> {
        if !self.is_private {
            return Ok(());
        }
        let host = headers.get(HOST).map(|host| String::from_utf8_lossy(host.as_bytes())).unwrap_or_default();
        if split_port(&host).is_some_and(|(host, _)| is_loopback_host(host)) {
            return Ok(());
        }
        Err(format!("this live view is served as localhost alone, and was asked for as {host:?}"))
    }

    fn check_origin(&self, text: &str) -> Result<(), String> {
        let scheme = text.split_once("://").map(|(scheme, _)| scheme.to_ascii_lowercase());
        // A page in a frame of another's can call itself `null`. What desktop programs say (`file://`, a
        // scheme of their own) no page of the web can.
        let is_program = scheme.is_some_and(|scheme| scheme != "http" && scheme != "https");
        let origin = text.parse::<WebOrigin>().ok();
        let is_known = |origin: &WebOrigin| origin.is_loopback() || self.allowed_origins.contains(origin);
        if is_program || origin.as_ref().is_some_and(is_known) {
            return Ok(());
        }
        let advice = origin.map_or(String::new(), |origin| format!(": --allow-origin {origin} lets it in"));
        Err(format!("a web page of {text:?} is not let in{advice}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(host: &'static str, origins: &[&'static str]) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(HOST, host.parse().unwrap());
        for origin in origins {
            headers.append(ORIGIN, origin.parse().unwrap());
        }
        headers
    }

    fn lets_in(admission: &Admission, host: &'static str, origins: &[&'static str]) -> bool {
        admission.check(&headers(host, origins)).is_ok()
    }

    #[test]
    fn programs_and_pages_of_the_viewers_own_machine_are_let_in_and_strangers_pages_are_not() {
        let admission =
            Admission { allowed_origins: vec!["https://viewer.example".parse().unwrap()], is_private: true };
        let friends: [&[&str]; 7] = [
            &[],
            &["file://"],
            &["app://viewer"],
            &["http://localhost:8080"],
            &["http://127.0.0.1"],
            &["https://viewer.example"],
            &["https://Viewer.Example:443"],
        ];
        for origins in friends {
            assert!(lets_in(&admission, "localhost:8765", origins), "{origins:?}");
        }
        let others: [&[&str]; 9] = [
            &["null"],
            &[""],
            &["https://evil.example"],
            &["http://viewer.example"],
            &["https://viewer.example.evil.example"],
            &["https://viewer.example:8443"],
            &["http://localhost.evil.example"],
            &["HTTP://evil.example"],
            &["http://localhost", "https://evil.example"],
        ];
        for origins in others {
            assert!(!lets_in(&admission, "localhost:8765", origins), "{origins:?}");
        }
    }

    #[test]
    fn what_only_this_machine_reaches_has_this_machines_name() {
        let private = Admission { is_private: true, ..Admission::default() };
        for host in ["localhost", "localhost:9000", "127.0.0.1:8765", "[::1]:8765"] {
            assert!(lets_in(&private, host, &[]), "{host}");
        }
        for host in ["evil.example:8765", "evil.example", "", "localhost:8765:1", "10.0.0.5:8765"] {
            assert!(!lets_in(&private, host, &[]), "{host}");
        }
        let public = Admission::default();
        assert!(lets_in(&public, "robot.local:8765", &[]));
        assert!(!lets_in(&public, "robot.local:8765", &["http://robot.local"]));
    }

    #[test]
    fn a_refused_page_is_told_what_would_let_it_in() {
        let refusal = Admission::default().check(&headers("robot", &["https://evil.example"])).unwrap_err();
        assert_eq!(refusal.status, StatusCode::FORBIDDEN);
        assert!(
            refusal.words.ends_with("--allow-origin https://evil.example lets it in"),
            "{}",
            refusal.words
        );
    }
}

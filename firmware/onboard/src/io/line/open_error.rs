//! Why a port cannot be used, in words for whoever set the robot up.

use std::io;

use biplane_cli::plain_error;
use rustix::io::Errno;

/// What the system said of a port, in words.
#[must_use]
pub(crate) fn reason(error: &io::Error) -> String {
    let is = |errno: Errno| error.raw_os_error() == Some(errno.raw_os_error());
    match error.kind() {
        io::ErrorKind::ResourceBusy => "another program has it open".to_owned(),
        io::ErrorKind::PermissionDenied => {
            format!("{}: users of serial ports are in the group dialout", plain_error(&error.to_string()))
        }
        _ if is(Errno::NOTTY) || is(Errno::ISDIR) => "it is not a serial port".to_owned(),
        _ => plain_error(&error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::line::tty::Tty;
    use std::path::Path;

    #[test]
    fn what_is_no_serial_port_is_called_so() {
        let file = std::env::temp_dir().join(format!("biplane-no-port-{}", std::process::id()));
        std::fs::write(&file, "no port").unwrap();
        for path in [file.as_path(), Path::new("/dev/null"), &std::env::temp_dir()] {
            let error = Tty::open(path, 9600).unwrap_err();
            assert_eq!(reason(&error), "it is not a serial port", "{}: {error}", path.display());
        }
        std::fs::remove_file(file).unwrap();
        let denied = io::Error::from(io::ErrorKind::PermissionDenied);
        assert!(reason(&denied).ends_with("users of serial ports are in the group dialout"));
        let missing = io::Error::from_raw_os_error(Errno::NOENT.raw_os_error());
        assert_eq!(reason(&missing), "No such file or directory");
        assert_eq!(reason(&io::ErrorKind::ResourceBusy.into()), "another program has it open");
    }
}

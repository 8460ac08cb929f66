//! The rig in `biplane info`: what was set for this robot line by line, what is as by default in a few words.

use std::io::{self, Write};

use biplane_cli::list;
use biplane_recording::Rig;

/// Letters of a line beside its indentation: it then fits into a terminal of 80 columns.
const WIDTH: usize = 76;
/// The mark of a comment takes two of them.
const COMMENT_WIDTH: usize = WIDTH - 2;

/// Prints a resolved rig. It is still TOML, and still the same rig.
pub(super) fn print(out: &mut impl Write, resolved: &str) -> io::Result<()> {
    let lines: Vec<&str> = resolved.lines().collect();
    let rig = Rig::parse(resolved).ok();
    let mut defaults = Vec::new();
    for (number, line) in lines.iter().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        if line.starts_with('[') {
            print_defaults(out, &mut defaults)?;
        }
        let is_default = rig.as_ref().is_some_and(|rig| is_same_without(rig, &lines, number));
        match line.strip_prefix("# ") {
            Some(remark) => defaults.push(remark.to_owned()),
            None if is_default => defaults.push((*line).to_owned()),
            None => print_line(out, line)?,
        }
    }
    print_defaults(out, &mut defaults)
}

/// Whether a line of a resolved rig says what a rig without it says, too. A laser's place is always said.
pub(super) fn goes_without_saying(lines: &[&str], number: usize) -> bool {
    let rig = Rig::parse(&lines.join("\n")).ok();
    !lines[number].starts_with("mount") && rig.is_some_and(|rig| is_same_without(&rig, lines, number))
}

/// Whether a rig's text without one of its lines is the same rig: the line says what goes without saying.
fn is_same_without(rig: &Rig, lines: &[&str], number: usize) -> bool {
    let others = lines.iter().enumerate().filter(|(other, _)| *other != number);
    let text: String = others.map(|(_, line)| format!("{line}\n")).collect();
    !lines[number].starts_with('[') && Rig::parse(&text).is_ok_and(|other| other == *rig)
}

/// A mount of many digits becomes a line for each of its keys.
fn print_line(out: &mut impl Write, line: &str) -> io::Result<()> {
    let keys = line.strip_prefix("mount = { ").and_then(|keys| keys.strip_suffix(" }"));
    match keys.filter(|_| line.len() > WIDTH) {
        Some(keys) => keys.split(", ").try_for_each(|key| writeln!(out, "    mount.{key}")),
        None => writeln!(out, "    {line}"),
    }
}

fn print_defaults(out: &mut impl Write, defaults: &mut Vec<String>) -> io::Result<()> {
    if defaults.is_empty() {
        return Ok(());
    }
    let text = format!("defaults: {}", defaults.join(", "));
    defaults.clear();
    out.write_all(list(&text, COMMENT_WIDTH, "    # ").as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_recording::rig::Mount;

    fn printed(rig: &Rig) -> String {
        let mut out = Vec::new();
        print(&mut out, &rig.to_toml()).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn defaults_are_comments_within_80_columns_and_the_rest_is_the_same_rig() {
        let mut rig = Rig::default();
        let mount = Mount { x: -1.0 / 3.0, y: 2e-7, z: 0.123_456_789, ..Mount::default() };
        rig.horizontal.mount = mount;
        rig.horizontal.baud = 500_000;
        rig.vertical.as_mut().unwrap().mount = mount;
        let text = printed(&rig);
        assert_eq!(Rig::parse(&text).unwrap(), rig, "{text}");
        assert!(text.lines().all(|line| line.len() <= 80), "{text}");
        assert_eq!(text.matches("\n    baud = 500000\n").count(), 1, "{text}");
        assert_eq!(text.matches("\n    mount.z = 0.123456789\n").count(), 2, "{text}");
        assert!(text.contains("# defaults: baud = 38400, fov_deg = 180, "), "{text}");
        assert!(text.contains("metres_per_tick: by the subclass"), "{text}");
    }

    #[test]
    fn of_the_template_only_the_ports_are_no_defaults() {
        let text = printed(&Rig::default());
        let set: Vec<&str> =
            text.lines().map(str::trim).filter(|line| !line.starts_with(['#', '['])).collect();
        let ports =
            ["port = \"/dev/lms-horizontal\"", "port = \"/dev/lms-vertical\"", "port = \"/dev/base\""];
        assert_eq!(set, ports, "{text}");
        assert!(text.lines().all(|line| line.len() <= 80), "{text}");
    }
}

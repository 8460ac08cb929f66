//! Time and memory of the stages, as bars.

use std::fmt::Write;

use crate::pipeline::summary::Summary;
use crate::view::markup::escaped;
use crate::view::report::text::{duration, grouped};

/// The section; nothing when no stage was timed.
pub(crate) fn section(summary: &Summary) -> String {
    let longest_s = summary.stages.iter().map(|stage| stage.wall_s).fold(0.0, f64::max);
    if longest_s <= 0.0 {
        return String::new();
    }
    let mut rows = String::new();
    for stage in &summary.stages {
        let memory = stage.peak_memory_bytes.map_or_else(String::new, megabytes);
        let _ = write!(
            rows,
            "<tr><th scope=\"row\">{}</th><td class=\"bar\"><svg viewBox=\"0 0 100 1\" preserveAspectRatio=\"none\" aria-hidden=\"true\">\
             <rect width=\"{:.1}\" height=\"1\"/></svg></td><td>{}</td><td>{}</td><td>{}</td><td>{memory}</td></tr>",
            escaped(&stage.stage),
            100.0 * stage.wall_s / longest_s,
            duration(stage.wall_s),
            duration(stage.cpu_s),
            grouped(stage.count),
        );
    }
    let peak = summary.cost.peak_memory_bytes.map_or_else(String::new, megabytes);
    format!(
        "<section><h2>Time and memory by stage</h2><div class=\"scroll\"><table class=\"figures stages\"><thead><tr><td></td><td></td>\
         <th scope=\"col\">time</th><th scope=\"col\">processor time</th><th scope=\"col\">count</th><th scope=\"col\">memory</th></tr></thead>\
         <tbody>{rows}</tbody><tfoot><tr><th scope=\"row\">all</th><td></td><td>{}</td><td>{}</td><td></td><td>{peak}</td></tr></tfoot>\
         </table></div><p class=\"note\">Count: the scans, points, triangles, planes or files that the stage made. Memory is the most the program had taken by the stage's end.</p></section>",
        duration(summary.cost.wall_s),
        duration(summary.cost.cpu_s),
    )
}

fn megabytes(bytes: u64) -> String {
    format!("{:.0} MB", bytes as f64 / 1e6)
}

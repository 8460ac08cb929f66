//! Writes the seeds of every corpus: `cargo run -p biplane-tests --example seeds` (files `seed-*` in
//! `tests/fuzz/corpus/TARGET/`).
//!
//! Telegrams and messages are those of the tests of their crates. Seeds that are text stand in the repository
//! as they were written.

#[path = "../../protocol/recording/tests/files/samples.rs"]
mod samples;
#[path = "../../protocol/wire/tests/cases/table.rs"]
mod table;

use std::fs::File;

use biplane::files::{PointRows, write_las, write_mesh, write_points};
use biplane::{Cloud, Mesh};
use biplane_mock::world::files::ply::write_ply;
use biplane_mock::world::mesh::LabeledMesh;
use biplane_recording::WriterOptions;
use biplane_recording::messages::{ByteArray, Message};
use biplane_tests::inputs::making::corpus;
use biplane_tests::inputs::named;
use biplane_wire::WireError;
use biplane_wire::roboclaw::Request as Asked;

fn main() -> anyhow::Result<()> {
    wire()?;
    sessions()?;
    messages()?;
    recordings()?;
    geometry()
}

fn save(target: &str, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = corpus::folder(named(target).ok_or_else(|| anyhow::anyhow!("no target {target}"))?);
    std::fs::create_dir_all(&folder)?;
    Ok(std::fs::write(folder.join(format!("seed-{name}")), bytes)?)
}

/// What `emit` writes.
fn written(emit: impl FnOnce(&mut [u8]) -> Result<usize, WireError>) -> Vec<u8> {
    let mut out = vec![0; 2048];
    let count = emit(&mut out).expect("it fits");
    out.truncate(count);
    out
}

/// Streams: the byte that says how they are taken, then one telegram of each form.
fn wire() -> anyhow::Result<()> {
    let scans = table::scans().into_iter().map(|scan| written(|out| scan.emit(0x80, out)));
    let pairs = table::pairs().into_iter().map(|pairs| written(|out| pairs.emit(0x80, out)));
    let s14 = table::s14_scans().into_iter().map(|scan| written(|out| scan.emit(0x80, out)));
    let replies = table::replies()
        .into_iter()
        .map(|reply| written(|out| reply.emit(0x81, biplane_wire::lms::Status::OK, out)));
    let long: Vec<Vec<u8>> = scans.chain(pairs).chain(s14).collect();
    save("lms", "replies", &[vec![0x3A], replies.collect::<Vec<_>>().concat()].concat())?;
    for (number, telegram) in long.iter().enumerate().filter(|(_, telegram)| telegram.len() < 900).step_by(3)
    {
        save("lms", &format!("scan-{number}"), &[&[0x22, 0x06], telegram.as_slice()].concat())?;
    }
    let requests = table::requests().into_iter().map(|request| written(|out| request.emit(0, out)));
    save("lms", "requests", &[vec![0x3B], requests.collect::<Vec<_>>().concat()].concat())?;
    let commands = table::commands().into_iter().map(|command| written(|out| command.emit(out)));
    save("p2os", "commands", &[vec![0x12], commands.collect::<Vec<_>>().concat()].concat())?;
    let reports = table::reports().into_iter().map(|report| written(|out| report.emit(out)));
    save("p2os", "reports", &[vec![0x12], reports.collect::<Vec<_>>().concat()].concat())?;
    let commands = table::rflex_commands().into_iter().map(|command| written(|out| command.emit(4, out)));
    save("rflex", "commands", &[vec![0x12], commands.collect::<Vec<_>>().concat()].concat())?;
    let reports = table::rflex_reports().into_iter().map(|report| written(|out| report.emit(0xFE, out)));
    save("rflex", "reports", &[vec![0x12], reports.collect::<Vec<_>>().concat()].concat())?;
    let commands = table::xsens_commands().into_iter().map(|command| written(|out| command.emit(out)));
    save("xsens", "commands", &[vec![0x12], commands.collect::<Vec<_>>().concat()].concat())?;
    let reports = table::xsens_reports().into_iter().map(|report| written(|out| report.emit(out)));
    save("xsens", "reports", &[vec![0x12], reports.collect::<Vec<_>>().concat()].concat())?;
    for (number, asked) in table::questions().into_iter().enumerate() {
        save("roboclaw", &format!("question-{number}"), &written(|out| asked.emit(out)))?;
    }
    let mut answers = Vec::new();
    for (question, answer) in table::answers() {
        let bytes = written(|out| answer.emit(Asked { address: 0x80, question }, out));
        for number in 0..7 {
            answers.extend([number, bytes.len() as u8]);
            answers.extend(&bytes);
        }
    }
    save("roboclaw", "answers", &answers)
}

/// A session of each kind that gets all its bytes, then one to which everything happens.
fn sessions() -> anyhow::Result<()> {
    for how in [0, 1, 2, 0x26, 0x2A, 0x1E, 0x6A] {
        // Time to whatever is due, then all that has come.
        let quiet = [0x00, 0x03].repeat(300);
        save("laser_session", &format!("quiet-{how:02x}"), &[&[how], quiet.as_slice()].concat())?;
    }
    for how in 0..12 {
        let quiet = [0x00, 0x03].repeat(150);
        let eventful: Vec<u8> = (0..32)
            .flat_map(|much| [0, 3, much << 3 | 2, much << 3 | 7, much << 3 | 4, 9, much << 3 | 5, 0, 3])
            .collect();
        save(
            "base_session",
            &format!("eventful-{how:02x}"),
            &[&[how], quiet.as_slice(), &eventful, &quiet].concat(),
        )?;
        if how < 4 {
            save(
                "laser_session",
                &format!("eventful-{how:02x}"),
                &[&[0x28 | how], quiet.as_slice(), &eventful, &quiet].concat(),
            )?;
        }
    }
    Ok(())
}

fn messages() -> anyhow::Result<()> {
    let mut out = Vec::new();
    let mut keep = |number: u8, name: &str, encode: &dyn Fn(&mut Vec<u8>)| {
        encode(&mut out);
        save("message", name, &[&[number], out.as_slice()].concat())
    };
    keep(0, "scan", &|out| samples::scan(3, "laser_horizontal").encode(out))?;
    keep(1, "odometry", &|out| samples::odometry(3).encode(out))?;
    keep(2, "pose", &|out| samples::pose(3).encode(out))?;
    keep(3, "tf", &|out| samples::transform(3).encode(out))?;
    keep(4, "diagnostics", &|out| samples::diagnostics(3).encode(out))?;
    keep(5, "bytes", &|out| ByteArray { data: b"pulse".to_vec() }.encode(out))
}

/// A short run with everything in it, as it is packed, and with every checksum left out, so that damage gets
/// past them.
fn recordings() -> anyhow::Result<()> {
    let path = std::env::temp_dir().join(format!("biplane-seeds-{}.mcap", std::process::id()));
    for (name, steps) in [("empty", 0), ("run", 3), ("chunks", 24)] {
        let options = WriterOptions { overwrite: true, ..WriterOptions::default() };
        samples::write_run(&path, steps, &options)?.finish()?;
        let bytes = std::fs::read(&path)?;
        save("mcap", name, &bytes)?;
        if steps < 10 {
            save("mcap", &format!("{name}-plain"), &plain(&bytes)?)?;
        }
    }
    Ok(std::fs::remove_file(path)?)
}

/// The same file with its chunks unpacked and no checksum; no index either, whose offsets would lie.
fn plain(bytes: &[u8]) -> anyhow::Result<Vec<u8>> {
    let (mut out, mut at) = (bytes[..8].to_vec(), 8);
    let record = |out: &mut Vec<u8>, opcode: u8, body: &[u8]| {
        out.push(opcode);
        out.extend((body.len() as u64).to_le_bytes());
        out.extend(body);
    };
    loop {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into()?) as usize;
        let (opcode, body) = (bytes[at], &bytes[at + 9..at + 9 + length]);
        at += 9 + length;
        match opcode {
            0x0F => {
                record(&mut out, 0x0F, &[0; 4]);
                record(&mut out, 0x02, &[0; 20]);
                out.extend(&bytes[..8]);
                return Ok(out);
            }
            0x06 => {
                // Times, size, checksum, name of the packing, packed size.
                let name = u32::from_le_bytes(body[28..32].try_into()?) as usize;
                let unpacked = zstd::decode_all(&body[32 + name + 8..])?;
                let head = [&body[..24], &[0; 8], &(unpacked.len() as u64).to_le_bytes()].concat();
                record(&mut out, 0x06, &[head, unpacked].concat());
            }
            _ => record(&mut out, opcode, body),
        }
    }
}

/// Clouds and meshes as this project writes them.
fn geometry() -> anyhow::Result<()> {
    let cloud = Cloud {
        points_m: (0..40_u8).map(|k| [f32::from(k % 7), f32::from(k / 7) * 0.5, 1.0]).collect(),
        scan: (0..40).map(|k| k / 10).collect(),
        beam: (0..40).map(|k| k % 10).collect(),
        origins_m: vec![[0.0, 0.5, 1.5]; 4],
        beams_per_scan: 10,
        ..Cloud::default()
    };
    let labels = [0; 20];
    let rows = |shift_m| PointRows {
        cloud: &cloud,
        labels: &labels,
        scan_numbers: &[],
        order: None,
        shift_m,
        source: "seeds",
    };
    for (name, shift_m) in [("near", [0.0; 3]), ("far", [4e5, 5e6, 0.0])] {
        let rows = rows(shift_m);
        let mut ply = Vec::new();
        write_points(&mut ply, &rows)?;
        save("ply", &format!("points-{name}"), &ply)?;
        for is_compressed in [false, true] {
            let path = std::env::temp_dir().join(format!("biplane-seeds-{}.las", std::process::id()));
            write_las(File::create(&path)?, &rows, is_compressed)?;
            save(
                "las",
                &format!("{name}{}", if is_compressed { ".laz" } else { ".las" }),
                &std::fs::read(&path)?,
            )?;
            std::fs::remove_file(path)?;
        }
    }
    let mesh =
        Mesh { vertices_m: cloud.points_m.clone(), triangles: (0..30).map(|k| [k, k + 1, k + 7]).collect() };
    let mut ply = Vec::new();
    write_mesh(&mut ply, &mesh, "a mesh")?;
    save("ply", "mesh", &ply)?;
    let faces: Vec<[u32; 3]> = mesh.triangles.clone();
    let labeled = LabeledMesh {
        vertices_m: mesh.vertices_m.iter().map(|v| v.map(f64::from)).collect(),
        planes: vec![3; faces.len()],
        faces,
    };
    let mut ply = Vec::new();
    write_ply(&mut ply, &labeled)?;
    save("ply", "world", &ply)
}

//! Known worlds: labeled surfaces and paths to drive through them.
//!
//! Named worlds are built by code; any triangle mesh can be one, with a path from a file. Each world has its
//! own frame (meters, z up); a drive moves it so that the drive starts at the origin of `map`.

pub mod built_in;
pub mod files;
pub mod ifc;
pub mod labels;
pub mod mesh;
pub mod path;
pub mod pose;
pub mod raycast;
mod rooms;
pub mod scene;
pub mod vec3;

use crate::world::files::obj;
use crate::world::files::obj::ObjError;
use crate::world::files::ply;
use crate::world::files::ply::PlyError;
use crate::world::ifc::StoreyChoice;
use biplane_ifc::{IfcError, Plan};
use built_in::round::RoundThing;
use mesh::{LabeledMesh, Object};
use path::{Path, PathError};
use std::io;
use std::path::PathBuf;

/// Names that [`World::named`] knows.
pub const NAMES: [&str; 12] = [
    "corridor",
    "building",
    "office",
    "ramp-up",
    "ramp-level",
    "ramp-down",
    "ramp-curved",
    "sill",
    "decks",
    "hall",
    "street",
    "pillars",
];

/// Surfaces, and ways to drive along them.
#[derive(Clone, Debug)]
pub struct World {
    /// Its name, or the file's.
    pub name: String,
    /// All surfaces, in the world's own frame.
    pub mesh: LabeledMesh,
    /// The round things among the surfaces; those of a mesh from a file are not known.
    pub rounds: Vec<RoundThing>,
    /// Named parts of the mesh, for a world from an OBJ file.
    pub objects: Vec<Object>,
    /// Rooms, walls and openings, for a world from an IFC file.
    pub plan: Option<Plan>,
    /// Built-in paths; the first is the usual one. Empty for a mesh from a file.
    pub paths: Vec<Path>,
}

/// Why there is no such world, or no such path through it.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// No built-in world, and no file that could be one.
    #[error("no world `{name}`: built in are {}; a file must end in .obj, .ply or .ifc", NAMES.join(", "))]
    Unknown {
        /// What was asked for.
        name: String,
    },
    /// A file could not be read.
    #[error("cannot read {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file is no OBJ.
    #[error("{}: {source}", path.display())]
    Obj {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ObjError,
    },
    /// A file is no PLY mesh.
    #[error("{}: {source}", path.display())]
    Ply {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: PlyError,
    },
    /// A file is no IFC, or has no such storey.
    #[error("{}: {source}", path.display())]
    Ifc {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: IfcError,
    },
    /// A storey was chosen of a world that is no IFC file.
    #[error(
        "world `{world}` is no IFC file: only these have storeys (`--storey`) and doors (`--doors`) to choose"
    )]
    NoStoreys {
        /// The world.
        world: String,
    },
    /// No room can be driven through.
    #[error(
        "world `{world}` has no room that a robot of 0.56 m width can drive through: give a path (`--path`)"
    )]
    NoRoom {
        /// The world.
        world: String,
    },
    /// The path file is no path.
    #[error("{}: {source}", path.display())]
    PathFile {
        /// The file.
        path: PathBuf,
        /// Why.
        source: PathError,
    },
    /// Neither a path of this world nor a file.
    #[error("no path `{name}` through world `{world}`: it has {known}; or give a path file (.toml)")]
    UnknownPath {
        /// What was asked for.
        name: String,
        /// The world.
        world: String,
        /// The paths that it has.
        known: String,
    },
    /// A mesh from a file has no path of its own.
    #[error("world `{world}` has no path of its own: give a path file (`--path`)")]
    NoPath {
        /// The world.
        world: String,
    },
}

impl World {
    /// A built-in world by name, or a mesh from an OBJ or PLY file, or the lowest storey of an IFC file.
    pub fn open(name: &str) -> Result<Self, WorldError> {
        Self::open_storey(name, &StoreyChoice::default())
    }

    /// The same with the choice of a storey, for an IFC file.
    pub fn open_storey(name: &str, storey: &StoreyChoice) -> Result<Self, WorldError> {
        let path = PathBuf::from(name);
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        if extension.as_deref() != Some("ifc") && *storey != StoreyChoice::default() {
            return Err(WorldError::NoStoreys { world: name.to_owned() });
        }
        if let Some(world) = Self::named(name) {
            return Ok(world);
        }
        match extension.as_deref() {
            Some("ifc") => Self::load_ifc(&path, storey),
            Some("obj" | "ply") => Self::load(&path, extension.as_deref() == Some("ply")),
            _ => Err(WorldError::Unknown { name: name.to_owned() }),
        }
    }

    fn load_ifc(path: &std::path::Path, storey: &StoreyChoice) -> Result<Self, WorldError> {
        let bytes =
            std::fs::read(path).map_err(|source| WorldError::File { path: path.to_owned(), source })?;
        let found = ifc::read(&bytes, storey);
        let found = found.map_err(|source| WorldError::Ifc { path: path.to_owned(), source })?;
        for (kind, count) in found.left_out {
            eprintln!("{}: {count} bodies of kind {kind} are left out", path.display());
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let (mesh, objects, plan) = (found.mesh, found.objects, Some(found.plan));
        Ok(Self { name, mesh, rounds: Vec::new(), objects, plan, paths: Vec::new() })
    }

    fn load(path: &std::path::Path, ply: bool) -> Result<Self, WorldError> {
        let bytes =
            std::fs::read(path).map_err(|source| WorldError::File { path: path.to_owned(), source })?;
        let (mut mesh, labeled, objects) = if ply {
            let found = ply::parse(&bytes);
            let (mesh, labeled) =
                found.map_err(|source| WorldError::Ply { path: path.to_owned(), source })?;
            (mesh, labeled, Vec::new())
        } else {
            let found = obj::parse(&String::from_utf8_lossy(&bytes));
            let (mesh, objects) =
                found.map_err(|source| WorldError::Obj { path: path.to_owned(), source })?;
            (mesh, false, objects)
        };
        if !labeled {
            labels::label_planes(&mut mesh);
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let paths = known_paths(&name)?;
        Ok(Self { name, mesh, rounds: Vec::new(), objects, plan: None, paths })
    }

    /// A drive through all rooms that a robot reaches, and the plan with the rooms that it enters marked; for
    /// a world with a plan.
    pub fn planned(&self, seed: u64) -> Result<(Path, Plan), WorldError> {
        let world = self.name.clone();
        let Some(plan) = &self.plan else { return Err(WorldError::NoPath { world }) };
        let Some((path, entered)) = rooms::plan_path(plan, &self.mesh, seed) else {
            return Err(WorldError::NoRoom { world });
        };
        let mut plan = plan.clone();
        for (room, entered) in plan.rooms.iter_mut().zip(entered) {
            room.entered = Some(entered);
        }
        Ok((path, plan))
    }

    /// The built-in world of that name. `hall`, `street` and `pillars` come in any number of plans: `hall-7`.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let (kind, plan) = match name.split_once('-') {
            Some((kind @ ("hall" | "street" | "pillars"), plan)) => (kind, plan.parse().ok()?),
            _ => (name, 0),
        };
        match kind {
            "corridor" => Some(built_in::corridor::corridor()),
            "building" => Some(built_in::building::building()),
            "office" => Some(built_in::office::office()),
            "ramp-up" => Some(built_in::ramps::up()),
            "ramp-level" => Some(built_in::ramps::up_under_a_level_ceiling()),
            "ramp-down" => Some(built_in::ramps::down()),
            "ramp-curved" => Some(built_in::ramps::curved()),
            "sill" => Some(built_in::ramps::sill()),
            "decks" => Some(built_in::decks::decks()),
            "hall" => Some(built_in::hall::hall(plan)),
            "street" => Some(built_in::street::street(plan)),
            "pillars" => Some(built_in::pillars::pillars(plan)),
            _ => None,
        }
    }

    /// The surfaces that are there during a drive, in the world's own frame.
    #[must_use]
    pub fn mesh_for(&self, path: &Path) -> LabeledMesh {
        let gone = |object: &&Object| {
            path.without_objects.iter().any(|start| object.name.starts_with(start.as_str()))
        };
        self.mesh.without(self.objects.iter().filter(gone))
    }

    /// The built-in path of that name; the usual one without a name.
    #[must_use]
    pub fn path(&self, name: Option<&str>) -> Option<&Path> {
        match name {
            Some(name) => self.paths.iter().find(|path| path.name == name),
            None => self.paths.first(),
        }
    }

    /// The built-in path of that name, or the path in that file; the usual one without a name.
    pub fn path_or_file(&self, name: Option<&str>) -> Result<Path, WorldError> {
        if let Some(path) = self.path(name) {
            return Ok(path.clone());
        }
        let world = self.name.clone();
        let Some(name) = name else { return Ok(self.planned(1)?.0) };
        if !name.ends_with(".toml") {
            let known: Vec<&str> = self.paths.iter().map(|path| path.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return Err(WorldError::UnknownPath { name: name.to_owned(), world, known });
        }
        let file = PathBuf::from(name);
        let text = std::fs::read_to_string(&file)
            .map_err(|source| WorldError::File { path: file.clone(), source })?;
        Path::parse(&text).map_err(|source| WorldError::PathFile { path: file, source })
    }
}

/// Path files of `hil-fixtures/worlds` for meshes that are not part of this project, by the name of the
/// mesh's file.
const KNOWN_PATHS: [(&str, &str, &str); 2] = [
    ("institute", "institute.toml", include_str!("../../worlds/institute.toml")),
    ("institute", "institute-closed.toml", include_str!("../../worlds/institute-closed.toml")),
];

fn known_paths(world: &str) -> Result<Vec<Path>, WorldError> {
    let parse = |(_, file, text): &(&str, &str, &str)| {
        Path::parse(text).map_err(|source| WorldError::PathFile { path: PathBuf::from(file), source })
    };
    KNOWN_PATHS.iter().filter(|(known, ..)| *known == world).map(parse).collect()
}

#[cfg(test)]
mod tests {
    use super::scene::Scene;
    use super::{NAMES, World, known_paths};
    use crate::rig::drive::Drive;
    use crate::world::vec3::Vec3;

    /// Every drive through a world: its name, the surfaces in `map`, the drive.
    fn drives_through(world: &World) -> Vec<(String, Scene, Drive)> {
        let drive_along = |path| {
            let (drive, scene) = Drive::through(world, path, 1).expect("drives");
            (format!("{} {}", world.name, path.name), scene, drive)
        };
        world.paths.iter().map(drive_along).collect()
    }

    fn drives() -> Vec<(String, Scene, Drive)> {
        NAMES.iter().flat_map(|name| drives_through(&World::named(name).expect("built in"))).collect()
    }

    /// The institute's model, where the test data are (`BIPLANE_DATA`, or beside the checkout).
    fn institute() -> Option<World> {
        let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");
        let data = std::env::var("BIPLANE_DATA").unwrap_or_else(|_| beside.to_owned());
        let file = std::path::Path::new(&data).join("models/institute.obj");
        file.exists().then(|| World::open(&file.display().to_string()).expect("a mesh"))
    }

    fn origins(drive: &Drive, height_m: f64) -> Vec<Vec3> {
        let steps = (drive.length_m() / 0.2) as i32;
        (0..=steps)
            .map(|k| drive.pose(drive.duration_s() * f64::from(k) / f64::from(steps)).translation_m)
            .map(|p| [p[0], p[1], p[2] + height_m])
            .collect()
    }

    #[test]
    fn only_ifc_files_have_storeys_to_choose() {
        let upper = super::StoreyChoice { index: 1, ..super::StoreyChoice::default() };
        for name in ["office", "shapes.obj"] {
            let refused = World::open_storey(name, &upper).expect_err("no storeys").to_string();
            assert!(refused.contains(&format!("`{name}` is no IFC file")), "{refused}");
        }
        assert!(World::open("office").is_ok());
    }

    fn world_is_flat(name: &str) -> bool {
        ["corridor", "building", "office", "hall", "street", "pillars"]
            .iter()
            .any(|flat| name.starts_with(flat))
    }

    #[test]
    fn every_built_in_drive_keeps_clear_of_all_surfaces() {
        let institute = institute().map(|world| drives_through(&world)).unwrap_or_default();
        for (name, scene, drive) in drives().into_iter().chain(institute) {
            for height_m in [0.1, 0.3, 0.5] {
                for origin in origins(&drive, height_m) {
                    for k in 0..24 {
                        let (sin, cos) = (f64::from(k) * 15.0_f64).to_radians().sin_cos();
                        let hit = scene.look(origin, [cos, sin, 0.0], 0.4);
                        assert_eq!(hit, None, "{name} at {origin:?}, {} degrees", k * 15);
                    }
                }
            }
        }
    }

    #[test]
    fn the_institutes_paths_are_part_of_the_program_and_one_opens_its_doors() {
        let paths = known_paths("institute").expect("paths");
        assert_eq!([paths[0].name.as_str(), paths[1].name.as_str()], ["institute", "institute-closed"]);
        let Some(world) = institute() else { return };
        assert_eq!(world.path(None), Some(&paths[0]));
        let left = world.mesh_for(&paths[0]).faces.len();
        assert!(left < world.mesh.faces.len() && world.mesh_for(&paths[1]) == world.mesh, "{left}");
    }

    #[test]
    fn every_built_in_drive_has_ground_under_it_and_rooms_have_a_ceiling() {
        for (name, scene, drive) in drives() {
            for origin in origins(&drive, 0.4) {
                let ground = scene.look(origin, [0.0, 0.0, -1.0], 1.0).map(|hit| hit.range_m);
                // At a kink of the ground the wheels stand on both sides of it.
                let off_m = if world_is_flat(&name) { 1e-9 } else { 0.021 };
                assert!(ground.is_some_and(|range_m| (range_m - 0.4).abs() < off_m), "{name} {origin:?}");
                let above = scene.look(origin, [0.0, 0.0, 1.0], 100.0);
                let highest_m = if world_is_flat(&name) { 4.5 } else { 5.5 };
                let outdoors = name.starts_with("building") || name.starts_with("street");
                assert!(outdoors || above.is_some_and(|hit| hit.range_m < highest_m), "{name}");
            }
        }
    }

    #[test]
    fn indoors_no_beam_escapes() {
        // Whatever is seen from inside must be closed: walls, windows, ceilings behind every open door.
        let indoors = |name: &str| !name.starts_with("building") && !name.starts_with("street");
        for (name, scene, drive) in drives().into_iter().filter(|(name, ..)| indoors(name)) {
            for origin in origins(&drive, 0.45).into_iter().step_by(3) {
                for (k, tilt) in (0..360).flat_map(|k| [-20.0_f64, 0.0, 25.0, 60.0].map(|tilt| (k, tilt))) {
                    let (sin, cos) = (f64::from(k) + 0.37).to_radians().sin_cos();
                    let (up, flat) = tilt.to_radians().sin_cos();
                    let seen = scene.look(origin, [flat * cos, flat * sin, up], 100.0);
                    assert!(seen.is_some(), "{name} from {origin:?}: {k} degrees, {tilt} up");
                }
            }
        }
    }

    #[test]
    fn the_office_loop_returns_to_where_it_began() {
        let world = World::named("office").expect("built in");
        let drive = Drive::new(world.path(Some("loop")).expect("its loop"), 1).expect("drives");
        let steps = 2000;
        let back = (0..=steps)
            .map(|k| drive.pose(drive.duration_s() * f64::from(k) / f64::from(steps)).translation_m)
            .skip(steps as usize / 2)
            .map(|p| p[0].hypot(p[1]))
            .fold(f64::INFINITY, f64::min);
        assert!(back < 0.1 && drive.length_m() > 50.0, "{back}");
    }
}

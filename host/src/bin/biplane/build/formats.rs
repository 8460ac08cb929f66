//! The model formats that `--formats` chooses from.

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// glTF 2.0 binary.
    Glb,
    /// PLY, triangles.
    Ply,
    /// OBJ, polygons.
    Obj,
    /// CityJSON 2.0.
    CityJson,
}

impl Format {
    /// All that are supported.
    pub const ALL: [Self; 4] = [Self::Glb, Self::Ply, Self::Obj, Self::CityJson];
}

/// Reads a format's name; planned ones are told apart from unknown ones.
pub fn parse(text: &str) -> Result<Format, String> {
    match text {
        "glb" => Ok(Format::Glb),
        "ply" => Ok(Format::Ply),
        "obj" => Ok(Format::Obj),
        "cityjson" | "city.json" => Ok(Format::CityJson),
        "dxf" | "ifc" | "laz" | "las" => {
            Err(format!("{text} is not supported yet; there are glb, ply, obj and cityjson"))
        }
        _ => Err("there are glb, ply, obj and cityjson".to_owned()),
    }
}

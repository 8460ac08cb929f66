//! The formats that `--formats` chooses from.

use crate::building::Building;
use crate::formats::text::model_json::ModelFile;

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// glTF 2.0 binary.
    Glb,
    /// PLY, triangles.
    Ply,
    /// OBJ, polygons.
    Obj,
    /// CityJSON 2.0.
    CityJson,
    /// DXF: plans and 3D faces.
    Dxf,
    /// Coarser copies of the glTF.
    Lod,
    /// MCAP: what viewers of robots show.
    Mcap,
    /// 3D Tiles 1.1: levels and pieces for web viewers.
    Tiles3d,
    /// IFC4: walls, slabs, doors, windows.
    Ifc,
    /// LAS: the points.
    #[cfg(feature = "las")]
    Las,
    /// LAZ: the points, compressed.
    #[cfg(feature = "las")]
    Laz,
}

/// What one word of `--formats` stands for.
pub(crate) type Formats = &'static [Format];

impl Format {
    /// All that are supported. The last two are not among `all`: a copy for viewers of robots, and 3D Tiles,
    /// a folder of files.
    pub(crate) const ALL: &[Self] = &[
        Self::Glb,
        Self::Ply,
        Self::Obj,
        Self::CityJson,
        Self::Dxf,
        Self::Ifc,
        Self::Lod,
        #[cfg(feature = "las")]
        Self::Las,
        #[cfg(feature = "las")]
        Self::Laz,
        Self::Mcap,
        Self::Tiles3d,
    ];

    /// Those that `all` stands for.
    const SINGLE: &[Self] = Self::ALL.split_at(Self::ALL.len() - 2).0;

    /// Those that are written when nothing is said.
    #[cfg(feature = "demo")]
    pub(crate) const USUAL: &[Self] = &[Self::Glb, Self::Ply, Self::Obj, Self::CityJson];

    /// The names of its files.
    pub(crate) const fn files(self) -> &'static [&'static str] {
        match self {
            Self::Glb => &["model.glb"],
            Self::Ply => &["model.ply"],
            Self::Obj => &["model.obj"],
            Self::CityJson => &["model.city.json"],
            Self::Dxf => &["model.dxf"],
            Self::Ifc => &["model.ifc"],
            Self::Lod => &["model.lod1.glb", "model.lod2.glb"],
            Self::Mcap => &["model.mcap"],
            Self::Tiles3d => &["tileset.json"],
            #[cfg(feature = "las")]
            Self::Las => &["points.las"],
            #[cfg(feature = "las")]
            Self::Laz => &["points.laz"],
        }
    }

    /// Whether its files hold the raw points, and not the model.
    pub(crate) fn is_of_points(self) -> bool {
        self.files().iter().any(|name| name.starts_with("points."))
    }

    /// Whether the model has to be read as a building for it.
    fn is_of_buildings(self) -> bool {
        matches!(self, Self::Dxf | Self::Ifc)
    }
}

/// Words of `--formats`.
const WORDS: &[(&str, Formats)] = &[
    ("glb", &[Format::Glb]),
    ("ply", &[Format::Ply]),
    ("obj", &[Format::Obj]),
    ("cityjson", &[Format::CityJson]),
    ("city.json", &[Format::CityJson]),
    ("dxf", &[Format::Dxf]),
    ("ifc", &[Format::Ifc]),
    ("lod", &[Format::Lod]),
    ("mcap", &[Format::Mcap]),
    ("3dtiles", &[Format::Tiles3d]),
    #[cfg(feature = "las")]
    ("las", &[Format::Las]),
    #[cfg(feature = "las")]
    ("laz", &[Format::Laz]),
    ("none", &[]),
    ("all", Format::SINGLE),
];

/// Reads a word.
pub(crate) fn parse(text: &str) -> Result<Formats, String> {
    let known = WORDS.iter().find(|(word, _)| *word == text).map(|(_, formats)| *formats);
    known.ok_or_else(|| {
        let words: Vec<&str> =
            WORDS.iter().map(|(word, _)| *word).filter(|word| *word != "city.json").collect();
        format!("there are {}", words.join(", "))
    })
}

/// The model as a building, when one of these formats wants one or rooms are known.
pub(crate) fn building(formats: &[Formats], file: &ModelFile<'_>) -> Option<Building> {
    let wanted = formats.iter().copied().flatten().any(|format| format.is_of_buildings());
    // Rooms alone cost nothing; the parts of surfaces are found for formats that want them.
    let elements = file.elements();
    let rooms = || Building { elements: elements.clone(), ..Building::default() };
    if wanted { Some(file.building()) } else { (!elements.is_empty()).then(rooms) }
}

/// What cannot be drawn of a building, in words.
pub(crate) fn hint(building: Option<&Building>) -> Option<&'static str> {
    building.filter(|building| building.floors_m.is_empty() && building.elements.is_empty()).map(|_| {
        "no floor with walls over it was found (z must be up), so model.dxf has no plan and model.ifc no storeys; `compact --floor M` says where it is"
    })
}

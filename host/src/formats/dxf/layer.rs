//! The layers of a drawing.

/// How a layer looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layer {
    /// Its name, without the storey.
    pub(crate) name: &'static str,
    /// AutoCAD's color index; 7 is black on white and white on black.
    pub(crate) color: u8,
    /// Hundredths of a millimeter on paper.
    pub(crate) weight: u8,
    /// Whether its lines are dashed.
    pub(crate) is_dashed: bool,
    /// Whether it is shown.
    pub(crate) is_on: bool,
}

impl Layer {
    /// Walls at the cut.
    pub(crate) const WALLS: Self = Self::new("WALLS", 7, 50);
    /// Walls filled: those whose thickness is known.
    pub(crate) const HATCH: Self = Self::new("HATCH", 252, 9);
    /// Sides of walls that nobody saw.
    pub(crate) const ASSUMED: Self = Self { is_dashed: true, ..Self::new("ASSUMED", 8, 13) };
    /// Doors and windows.
    pub(crate) const OPENINGS: Self = Self::new("OPENINGS", 30, 18);
    /// What else is cut.
    pub(crate) const SECTION: Self = Self::new("SECTION", 8, 13);
    /// Outlines of floors.
    pub(crate) const FLOOR: Self = Self::new("FLOOR", 33, 13);
    /// Outlines of ceilings, which are over the cut.
    pub(crate) const CEILING: Self = Self { is_dashed: true, ..Self::new("CEILING", 9, 9) };
    /// Sizes and titles.
    pub(crate) const LABELS: Self = Self::new("LABELS", 7, 13);
    /// The polygons in 3D.
    pub(crate) const SURFACES: Self = Self::new("SURFACES", 151, 13);
    /// What nobody measured, in 3D.
    pub(crate) const INFERRED: Self = Self::new("INFERRED", 211, 9);
    /// Fine structure in 3D.
    pub(crate) const LEFTOVERS: Self = Self::new("LEFTOVERS", 8, 9);

    /// The same, shown or not.
    pub(crate) fn shown(self, is_on: bool) -> Self {
        Self { is_on, ..self }
    }

    /// One with full lines, shown.
    pub(crate) const fn new(name: &'static str, color: u8, weight: u8) -> Self {
        Self { name, color, weight, is_dashed: false, is_on: true }
    }
}

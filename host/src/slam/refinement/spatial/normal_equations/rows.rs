//! Residuals of any kind, each over a few variables.

/// A part of a row: a variable, and the derivative of the residual by it.
pub(crate) type Part = (usize, [f64; 3]);

/// Linearized residuals, each scaled by its `weight` = 1 / variance; their parts one after the other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    parts: Vec<Part>,
    list: Vec<Row>,
}

#[derive(Clone, Copy, Debug)]
struct Row {
    /// Where its parts end.
    end: usize,
    residual: f64,
    weight: f64,
}

impl Rows {
    /// Adds a residual. A variable may stand in it twice: its parts add up.
    pub(crate) fn push(&mut self, parts: &[Part], residual: f64, weight: f64) {
        self.parts.extend_from_slice(parts);
        self.list.push(Row { end: self.parts.len(), residual, weight });
    }

    /// The parts, the residual and the weight of each one.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&[Part], f64, f64)> {
        let mut start = 0;
        self.list.iter().map(move |row| {
            let parts = &self.parts[start..row.end];
            start = row.end;
            (parts, row.residual, row.weight)
        })
    }
}

//! The parts of a DXF file of release 2000 that every reader wants, and entities on layers.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::layer::Layer;
use crate::formats::text::number::Number;

/// Handles of the tables, blocks and dictionaries that every file has.
mod handle {
    pub(crate) const BLOCK_RECORDS: u64 = 0x9;
    pub(crate) const MODEL: u64 = 0x17;
    pub(crate) const PAPER: u64 = 0x1B;
    pub(crate) const ROOT: u64 = 0xA;
    pub(crate) const GROUPS: u64 = 0xC;
    /// The first that is free.
    pub(crate) const FREE: u64 = 0x100;
}

/// A drawing in the making.
pub(crate) struct Document {
    comments: Vec<String>,
    layers: Vec<(String, Layer)>,
    entities: String,
    next: u64,
    low: [f64; 3],
    high: [f64; 3],
}

impl Document {
    /// An empty one with comments at its head.
    pub(crate) fn new(comments: Vec<String>) -> Self {
        let (low, high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        Self { comments, layers: Vec::new(), entities: String::new(), next: handle::FREE, low, high }
    }

    /// Makes a layer, unless it is there.
    pub(crate) fn layer(&mut self, name: &str, layer: Layer) {
        if !self.layers.iter().any(|(known, _)| known == name) {
            self.layers.push((name.to_owned(), layer));
        }
    }

    fn put(&mut self, code: u16, value: impl std::fmt::Display) {
        pair(&mut self.entities, code, value);
    }

    fn begin(&mut self, kind: &str, layer: &str, class: &str) {
        let handle = self.next;
        self.next += 1;
        self.put(0, kind);
        self.put(5, format_args!("{handle:X}"));
        self.put(330, format_args!("{:X}", handle::MODEL));
        self.put(100, "AcDbEntity");
        self.put(8, layer);
        self.put(100, class);
    }

    /// A point as group codes `first`, `first` + 10, `first` + 20.
    fn point(&mut self, first: u16, p: [f64; 3]) {
        for (axis, value) in p.into_iter().enumerate() {
            self.put(first + 10 * axis as u16, Number(value));
            self.low[axis] = self.low[axis].min(value);
            self.high[axis] = self.high[axis].max(value);
        }
    }

    /// A straight line.
    pub(crate) fn line(&mut self, layer: &str, from: [f64; 3], to: [f64; 3]) {
        self.begin("LINE", layer, "AcDbLine");
        self.point(10, from);
        self.point(11, to);
    }

    /// A closed level ring at the height of its first corner.
    pub(crate) fn ring(&mut self, layer: &str, corners: &[[f64; 3]]) {
        let Some(first) = corners.first() else { return };
        self.begin("LWPOLYLINE", layer, "AcDbPolyline");
        self.put(90, corners.len());
        self.put(70, 1);
        self.put(38, Number(first[2]));
        for corner in corners {
            self.put(10, Number(corner[0]));
            self.put(20, Number(corner[1]));
        }
    }

    /// A filled level area at the height of its first corner.
    pub(crate) fn filled(&mut self, layer: &str, corners: &[[f64; 3]]) {
        let Some(first) = corners.first() else { return };
        self.begin("HATCH", layer, "AcDbHatch");
        self.point(10, [0.0, 0.0, first[2]]);
        for (code, value) in [(210, 0), (220, 0), (230, 1)] {
            self.put(code, value);
        }
        self.put(2, "SOLID");
        // Filled, on its own, one outer border of straight edges.
        for (code, value) in [(70, 1), (71, 0), (91, 1), (92, 3), (72, 0), (73, 1)] {
            self.put(code, value);
        }
        self.put(93, corners.len());
        for corner in corners {
            self.put(10, Number(corner[0]));
            self.put(20, Number(corner[1]));
        }
        for (code, value) in [(97, 0), (75, 0), (76, 1), (98, 0)] {
            self.put(code, value);
        }
    }

    /// A triangle, some of whose edges are not drawn.
    pub(crate) fn face(&mut self, layer: &str, corners: [[f64; 3]; 3], hidden: [bool; 3]) {
        self.begin("3DFACE", layer, "AcDbFace");
        let [a, b, c] = corners;
        for (code, corner) in [(10, a), (11, b), (12, c), (13, c)] {
            self.point(code, corner);
        }
        // The fourth edge leads back to the first corner, the third has no length.
        let flags = u8::from(hidden[0]) + 2 * u8::from(hidden[1]) + 8 * u8::from(hidden[2]);
        self.put(70, flags);
    }

    /// A text with the middle of its foot at a point, turned by so many degrees.
    pub(crate) fn text(&mut self, layer: &str, at: [f64; 3], height_m: f64, degrees: f64, text: &str) {
        self.begin("TEXT", layer, "AcDbText");
        self.point(10, at);
        self.put(40, Number(height_m));
        self.put(1, escaped(text));
        self.put(50, Number(degrees));
        self.put(72, 1);
        self.point(11, at);
        self.put(100, "AcDbText");
    }

    /// A level text that starts at a point.
    pub(crate) fn start_text(&mut self, layer: &str, at: [f64; 3], height_m: f64, text: &str) {
        self.begin("TEXT", layer, "AcDbText");
        self.point(10, at);
        self.put(40, Number(height_m));
        self.put(1, escaped(text));
        self.put(100, "AcDbText");
    }

    /// Writes everything.
    pub(crate) fn write(mut self, out: &mut impl Write) -> io::Result<()> {
        if self.low[0] > self.high[0] {
            (self.low, self.high) = ([0.0; 3], [0.0; 3]);
        }
        let mut head = String::new();
        for comment in &self.comments {
            pair(&mut head, 999, escaped(comment));
        }
        self.header(&mut head);
        self.tables(&mut head);
        blocks(&mut head);
        section(&mut head, "ENTITIES");
        out.write_all(head.as_bytes())?;
        out.write_all(self.entities.as_bytes())?;
        let mut tail = String::new();
        pair(&mut tail, 0, "ENDSEC");
        objects(&mut tail);
        pair(&mut tail, 0, "EOF");
        out.write_all(tail.as_bytes())
    }

    fn header(&self, text: &mut String) {
        section(text, "HEADER");
        let mut variable = |name: &str, values: &[(u16, String)]| {
            pair(text, 9, name);
            values.iter().for_each(|(code, value)| pair(text, *code, value));
        };
        let point =
            |p: [f64; 3]| [10, 20, 30].into_iter().zip(p.map(|v| Number(v).to_string())).collect::<Vec<_>>();
        variable("$ACADVER", &[(1, "AC1015".to_owned())]);
        variable("$DWGCODEPAGE", &[(3, "ANSI_1252".to_owned())]);
        variable("$INSBASE", &point([0.0; 3]));
        variable("$EXTMIN", &point(self.low));
        variable("$EXTMAX", &point(self.high));
        // Meters: units of blocks, and metric patterns.
        variable("$INSUNITS", &[(70, "6".to_owned())]);
        variable("$MEASUREMENT", &[(70, "1".to_owned())]);
        variable("$LUNITS", &[(70, "2".to_owned())]);
        variable("$LUPREC", &[(70, "3".to_owned())]);
        variable("$HANDSEED", &[(5, format!("{:X}", self.next))]);
        pair(text, 0, "ENDSEC");
    }

    fn tables(&self, text: &mut String) {
        section(text, "TABLES");
        self.view(text);
        table(text, "LTYPE", 2, 4);
        for (name, handle) in [("ByBlock", 0x24), ("ByLayer", 0x25), ("Continuous", 0x26)] {
            record(text, "LTYPE", handle, 2, "AcDbLinetypeTableRecord", name);
            pairs(text, &[(3, ""), (72, "65"), (73, "0"), (40, "0.0")]);
        }
        record(text, "LTYPE", 0x27, 2, "AcDbLinetypeTableRecord", "DASHED");
        pairs(
            text,
            &[
                (3, "Dashed"),
                (72, "65"),
                (73, "2"),
                (40, "0.3"),
                (49, "0.2"),
                (74, "0"),
                (49, "-0.1"),
                (74, "0"),
            ],
        );
        pair(text, 0, "ENDTAB");
        self.layers(text);
        table(text, "STYLE", 5, 1);
        record(text, "STYLE", 0x29, 5, "AcDbTextStyleTableRecord", "Standard");
        pairs(text, &[(40, "0.0"), (41, "1.0"), (50, "0.0"), (71, "0"), (42, "0.15"), (3, "txt"), (4, "")]);
        pair(text, 0, "ENDTAB");
        for (name, handle) in [("VIEW", 7), ("UCS", 6)] {
            table(text, name, handle, 0);
            pair(text, 0, "ENDTAB");
        }
        table(text, "APPID", 3, 1);
        record(text, "APPID", 0x2A, 3, "AcDbRegAppTableRecord", "ACAD");
        pair(text, 0, "ENDTAB");
        table(text, "DIMSTYLE", 4, 1);
        pair(text, 100, "AcDbDimStyleTable");
        dimension_style(text);
        pair(text, 0, "ENDTAB");
        table(text, "BLOCK_RECORD", handle::BLOCK_RECORDS, 2);
        for (name, own) in [("*Model_Space", handle::MODEL), ("*Paper_Space", handle::PAPER)] {
            record_of(text, "BLOCK_RECORD", own, handle::BLOCK_RECORDS, "AcDbBlockTableRecord");
            pair(text, 2, name);
        }
        pairs(text, &[(0, "ENDTAB"), (0, "ENDSEC")]);
    }

    /// The view that a program opens with: everything, from above.
    fn view(&self, text: &mut String) {
        table(text, "VPORT", 8, 1);
        record(text, "VPORT", 0x23, 8, "AcDbViewportTableRecord", "*Active");
        let middle = |axis: usize| Number((self.low[axis] + self.high[axis]) / 2.0).to_string();
        let [width, height] = [0, 1].map(|axis| self.high[axis] - self.low[axis]);
        let height = Number((1.1 * height.max(width / 1.5)).max(1.0)).to_string();
        pairs(text, &[(10, "0.0"), (20, "0.0"), (11, "1.0"), (21, "1.0")]);
        pairs(text, &[(12, &middle(0)), (22, &middle(1))]);
        pairs(text, &[(13, "0.0"), (23, "0.0"), (14, "0.5"), (24, "0.5"), (15, "0.5"), (25, "0.5")]);
        pairs(text, &[(16, "0.0"), (26, "0.0"), (36, "1.0"), (17, "0.0"), (27, "0.0"), (37, "0.0")]);
        pairs(
            text,
            &[(40, &height), (41, "1.5"), (42, "50.0"), (43, "0.0"), (44, "0.0"), (50, "0.0"), (51, "0.0")],
        );
        pairs(
            text,
            &[(71, "0"), (72, "1000"), (73, "1"), (74, "3"), (75, "0"), (76, "0"), (77, "0"), (78, "0")],
        );
        pair(text, 0, "ENDTAB");
    }

    fn layers(&self, text: &mut String) {
        table(text, "LAYER", 1, self.layers.len() + 1);
        let zero = ("0".to_owned(), Layer::new("0", 7, 25));
        for (number, (name, layer)) in std::iter::once(&zero).chain(&self.layers).enumerate() {
            record(text, "LAYER", 0x40 + number as u64, 1, "AcDbLayerTableRecord", name);
            let color = if layer.is_on { i16::from(layer.color) } else { -i16::from(layer.color) };
            pair(text, 62, color);
            pair(text, 6, if layer.is_dashed { "DASHED" } else { "Continuous" });
            pair(text, 370, layer.weight);
        }
        pair(text, 0, "ENDTAB");
    }
}

/// A text in the code page: what is not ASCII as DXF's `\U+XXXX`.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for unit in text.encode_utf16() {
        match u8::try_from(unit) {
            Ok(byte) if byte.is_ascii_graphic() || byte == b' ' => out.push(char::from(byte)),
            Ok(byte) if byte.is_ascii() => out.push(' '),
            _ => {
                let _ = write!(out, "\\U+{unit:04X}");
            }
        }
    }
    out
}

fn pair(text: &mut String, code: u16, value: impl std::fmt::Display) {
    let _ = writeln!(text, "{code:>3}\n{value}");
}

fn pairs(text: &mut String, all: &[(u16, &str)]) {
    all.iter().for_each(|(code, value)| pair(text, *code, value));
}

fn section(text: &mut String, name: &str) {
    pairs(text, &[(0, "SECTION"), (2, name)]);
}

fn table(text: &mut String, name: &str, handle: u64, records: usize) {
    pairs(text, &[(0, "TABLE"), (2, name)]);
    pair(text, 5, format_args!("{handle:X}"));
    pairs(text, &[(330, "0"), (100, "AcDbSymbolTable")]);
    pair(text, 70, records);
}

fn record(text: &mut String, kind: &str, handle: u64, owner: u64, class: &str, name: &str) {
    record_of(text, kind, handle, owner, class);
    pair(text, 2, name);
    pair(text, 70, 0);
}

fn record_of(text: &mut String, kind: &str, handle: u64, owner: u64, class: &str) {
    pair(text, 0, kind);
    pair(text, 5, format_args!("{handle:X}"));
    pair(text, 330, format_args!("{owner:X}"));
    pair(text, 100, "AcDbSymbolTableRecord");
    pair(text, 100, class);
}

/// The one style of dimensions, as every file must have it.
fn dimension_style(text: &mut String) {
    pair(text, 0, "DIMSTYLE");
    pair(text, 105, "2B");
    pairs(text, &[(330, "4"), (100, "AcDbSymbolTableRecord"), (100, "AcDbDimStyleTableRecord")]);
    pairs(
        text,
        &[
            (2, "Standard"),
            (70, "0"),
            (40, "1.0"),
            (41, "0.15"),
            (42, "0.05"),
            (44, "0.1"),
            (140, "0.15"),
            (147, "0.05"),
        ],
    );
}

fn blocks(text: &mut String) {
    section(text, "BLOCKS");
    for (name, owner, own) in [("*Model_Space", handle::MODEL, 0x18), ("*Paper_Space", handle::PAPER, 0x1C)] {
        pair(text, 0, "BLOCK");
        pair(text, 5, format_args!("{own:X}"));
        pair(text, 330, format_args!("{owner:X}"));
        pairs(text, &[(100, "AcDbEntity"), (8, "0"), (100, "AcDbBlockBegin"), (2, name), (70, "0")]);
        pairs(text, &[(10, "0.0"), (20, "0.0"), (30, "0.0"), (3, name), (1, "")]);
        pair(text, 0, "ENDBLK");
        pair(text, 5, format_args!("{:X}", own + 1));
        pair(text, 330, format_args!("{owner:X}"));
        pairs(text, &[(100, "AcDbEntity"), (8, "0"), (100, "AcDbBlockEnd")]);
    }
    pair(text, 0, "ENDSEC");
}

fn objects(text: &mut String) {
    section(text, "OBJECTS");
    pair(text, 0, "DICTIONARY");
    pair(text, 5, format_args!("{:X}", handle::ROOT));
    pairs(text, &[(330, "0"), (100, "AcDbDictionary"), (281, "1"), (3, "ACAD_GROUP")]);
    pair(text, 350, format_args!("{:X}", handle::GROUPS));
    pair(text, 0, "DICTIONARY");
    pair(text, 5, format_args!("{:X}", handle::GROUPS));
    pair(text, 330, format_args!("{:X}", handle::ROOT));
    pairs(text, &[(100, "AcDbDictionary"), (281, "1"), (0, "ENDSEC")]);
}

//! Curves as chains of points.

use std::f64::consts::{PI, TAU};

use crate::geometry::placement::{axes, triple};
use crate::geometry::vector::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::step::value::{Entity, Step, Value};

/// Angle of a circle that becomes one straight piece, radians: 10 degrees, 1 mm on a radius of 0.3 m.
const ARC_STEP_RAD: f64 = PI / 18.0;
/// Curves of curves deeper than this are a circle.
const MAX_DEPTH: usize = 16;

/// Reads curves; angles in radians are angles of the file times `radian`.
#[derive(Clone, Copy)]
pub(crate) struct Curves<'a> {
    pub(crate) step: &'a Step,
    pub(crate) radian: f64,
}

impl<'a> Curves<'a> {
    /// The points of a curve; a closed one ends where it begins, or not.
    pub(crate) fn points(&self, value: &Value) -> Option<Vec<Vec3>> {
        self.of(self.step.follow(value)?, 0)
    }

    /// The ring of a closed curve, without its first point again.
    pub(crate) fn ring(&self, value: &Value) -> Option<Vec<Vec3>> {
        let mut points = self.points(value)?;
        points.dedup_by(|a, b| norm(sub(*a, *b)) < 1e-9);
        while points.len() > 1 && norm(sub(points[0], points[points.len() - 1])) < 1e-9 {
            points.pop();
        }
        (points.len() > 2).then_some(points)
    }

    fn of(&self, curve: &Entity, depth: usize) -> Option<Vec<Vec3>> {
        if depth > MAX_DEPTH {
            return None;
        }
        match curve.kind.as_str() {
            "IFCPOLYLINE" => curve.at(0).list().iter().map(|point| triple(self.step, point)).collect(),
            "IFCINDEXEDPOLYCURVE" => self.indexed(curve),
            "IFCCOMPOSITECURVE" | "IFC2DCOMPOSITECURVE" => self.composite(curve, depth),
            "IFCTRIMMEDCURVE" => self.trimmed(curve, depth),
            "IFCCIRCLE" | "IFCELLIPSE" => Some(self.arc(curve, 0.0, TAU)),
            "IFCBSPLINECURVE" | "IFCBSPLINECURVEWITHKNOTS" | "IFCRATIONALBSPLINECURVEWITHKNOTS" => {
                curve.at(1).list().iter().map(|point| triple(self.step, point)).collect()
            }
            _ => None,
        }
    }

    fn indexed(&self, curve: &Entity) -> Option<Vec<Vec3>> {
        let point = |value: &Value| match value.numbers()[..] {
            [x, y] => Some([x, y, 0.0]),
            [x, y, z] => Some([x, y, z]),
            _ => None,
        };
        let all: Vec<Vec3> =
            self.step.follow(curve.at(0))?.at(0).list().iter().map(point).collect::<Option<_>>()?;
        let segments = curve.at(1).list();
        if segments.is_empty() {
            return Some(all);
        }
        let mut points = Vec::new();
        for segment in segments {
            let Value::Typed(kind, values) = segment else { return None };
            let indices = values.first()?.numbers();
            let at = |index: &f64| all.get((*index as usize).checked_sub(1)?).copied();
            let corners: Vec<Vec3> = indices.iter().map(at).collect::<Option<_>>()?;
            match (kind.as_str(), &corners[..]) {
                ("IFCARCINDEX", [a, b, c]) => points.extend(arc_through(*a, *b, *c)),
                _ => points.extend(corners),
            }
        }
        Some(points)
    }

    fn composite(&self, curve: &Entity, depth: usize) -> Option<Vec<Vec3>> {
        let mut points: Vec<Vec3> = Vec::new();
        for segment in curve.at(0).list() {
            let segment = self.step.follow(segment)?;
            let mut piece = self.of(self.step.follow(segment.at(2))?, depth + 1)?;
            if segment.at(1).is("F") {
                piece.reverse();
            }
            points.extend(piece);
        }
        Some(points)
    }

    fn trimmed(&self, curve: &Entity, depth: usize) -> Option<Vec<Vec3>> {
        let basis = self.step.follow(curve.at(0))?;
        let place = |trim: &Value| trim.list().iter().find_map(|value| triple(self.step, value));
        let parameter = |trim: &Value| trim.list().iter().find_map(Value::number);
        let is_forward = !curve.at(3).is("F");
        match basis.kind.as_str() {
            "IFCCIRCLE" | "IFCELLIPSE" => {
                let angle = |trim: &Value| match (parameter(trim), place(trim)) {
                    (Some(value), _) => Some(value * self.radian),
                    (None, Some(point)) => Some(self.angle_of(basis, point)),
                    _ => None,
                };
                let (from, to) = (angle(curve.at(1))?, angle(curve.at(2))?);
                // A curve against its sense runs from its first to its second trim backward.
                let turn = if is_forward { to - from } else { from - to }.rem_euclid(TAU);
                let turn = if turn < 1e-9 { TAU } else { turn };
                Some(self.arc(basis, from, if is_forward { turn } else { -turn }))
            }
            "IFCLINE" => {
                let origin = triple(self.step, basis.at(0))?;
                let vector = self.step.follow(basis.at(1))?;
                let along = unit(triple(self.step, vector.at(0))?)?;
                let length = vector.at(1).number().unwrap_or(1.0);
                let at = |trim: &Value| {
                    place(trim).or_else(|| Some(add(origin, scale(along, length * parameter(trim)?))))
                };
                Some(vec![at(curve.at(1))?, at(curve.at(2))?])
            }
            _ => {
                let mut points = self.of(basis, depth + 1)?;
                if !is_forward {
                    points.reverse();
                }
                Some(points)
            }
        }
    }

    fn radii(conic: &Entity) -> [f64; 2] {
        let first = conic.at(1).number().unwrap_or(0.0);
        [first, if conic.kind == "IFCELLIPSE" { conic.at(2).number().unwrap_or(first) } else { first }]
    }

    fn angle_of(&self, conic: &Entity, point: Vec3) -> f64 {
        let frame = axes(self.step, conic.at(0));
        let [a, b] = Self::radii(conic);
        let off = sub(point, frame.origin);
        (dot(off, frame.axes[1]) * a).atan2(dot(off, frame.axes[0]) * b)
    }

    fn arc(&self, conic: &Entity, from: f64, turn: f64) -> Vec<Vec3> {
        let frame = axes(self.step, conic.at(0));
        let [a, b] = Self::radii(conic);
        let steps = (turn.abs() / ARC_STEP_RAD).ceil().clamp(2.0, 720.0) as usize;
        let at = |k: usize| from + turn * k as f64 / steps as f64;
        (0..=steps).map(|k| frame.point([a * at(k).cos(), b * at(k).sin(), 0.0])).collect()
    }
}

/// The arc from a over b to c; the chain itself when they lie in line.
fn arc_through(a: Vec3, b: Vec3, c: Vec3) -> Vec<Vec3> {
    let (u, v) = (sub(b, a), sub(c, a));
    let normal = cross(u, v);
    let area = dot(normal, normal);
    if area < 1e-18 {
        return vec![a, b, c];
    }
    let to_center = scale(
        add(scale(cross(normal, u), dot(v, v)), scale(cross(v, normal), dot(u, u))),
        1.0 / (2.0 * area),
    );
    let center = add(a, to_center);
    let radius = norm(to_center);
    let (Some(x), Some(z)) = (unit(sub(a, center)), unit(normal)) else { return vec![a, b, c] };
    let y = cross(z, x);
    let off = sub(c, center);
    let turn = dot(off, y).atan2(dot(off, x)).rem_euclid(TAU);
    let steps = (turn / ARC_STEP_RAD).ceil().max(2.0) as usize;
    let at = |k: usize| turn * k as f64 / steps as f64;
    let place = |angle: f64| add(center, add(scale(x, radius * angle.cos()), scale(y, radius * angle.sin())));
    (0..=steps).map(|k| place(at(k))).collect()
}

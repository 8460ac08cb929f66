//! Representation items as triangles: solids, faceted bodies, mapped items, booleans.

use std::collections::BTreeMap;

use crate::geometry::bsp::{difference, intersection};
use crate::geometry::curve::Curves;
use crate::geometry::mesh::{Triangle, face};
use crate::geometry::placement::{axes, operator, triple};
use crate::geometry::profile::profiles;
use crate::geometry::swept::{extrude, half_space, revolve};
use crate::geometry::vector::{Placement, Vec3, scale, unit};
use crate::step::value::{Entity, Value};

/// Items of items deeper than this are a circle.
const MAX_DEPTH: usize = 24;
/// Points this near to a plane lie on it when bodies are cut, meters.
const NEAR_M: f64 = 1e-5;

/// Whether bodies are as they stand in the building or as they were before anything was cut off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cuts {
    /// As they stand.
    Made,
    /// Before: only the first operand of booleans.
    Left,
}

/// Reads items, and counts the kinds that it does not know.
pub(crate) struct Items<'a> {
    pub(crate) curves: Curves<'a>,
    pub(crate) meter: f64,
    pub(crate) cuts: Cuts,
    /// Items that may still be read: items of items of items must not grow without bound.
    pub(crate) budget: usize,
    pub(crate) unknown: BTreeMap<String, usize>,
}

impl Items<'_> {
    /// The triangles of an item, in the frame that it is stated in.
    pub(crate) fn triangles(&mut self, value: &Value) -> Vec<Triangle> {
        self.nested(value, 0)
    }

    fn nested(&mut self, value: &Value, depth: usize) -> Vec<Triangle> {
        let step = self.curves.step;
        let Some(item) = step.follow(value).filter(|_| depth < MAX_DEPTH && self.budget > 0) else {
            return Vec::new();
        };
        self.budget -= 1;
        match item.kind.as_str() {
            "IFCEXTRUDEDAREASOLID" => self.extruded(item),
            "IFCREVOLVEDAREASOLID" => self.revolved(item),
            "IFCFACETEDBREP" | "IFCFACETEDBREPWITHVOIDS" => {
                step.follow(item.at(0)).map(|shell| self.shell(shell)).unwrap_or_default()
            }
            "IFCFACEBASEDSURFACEMODEL" | "IFCSHELLBASEDSURFACEMODEL" => {
                let shells = item.at(0).list().iter().filter_map(|shell| step.follow(shell));
                shells.flat_map(|shell| self.shell(shell)).collect()
            }
            "IFCTRIANGULATEDFACESET" => self.triangulated(item),
            "IFCPOLYGONALFACESET" => self.polygonal(item),
            "IFCMAPPEDITEM" => self.mapped(item, depth),
            "IFCBOOLEANRESULT" | "IFCBOOLEANCLIPPINGRESULT" => self.boolean(item, depth),
            "IFCCSGSOLID" => self.nested(item.at(0), depth + 1),
            "IFCBLOCK" => self.block(item),
            "IFCBOUNDINGBOX" | "IFCPOLYLINE" | "IFCGEOMETRICCURVESET" | "IFCGEOMETRICSET" => Vec::new(),
            kind => {
                *self.unknown.entry(kind.to_owned()).or_default() += 1;
                Vec::new()
            }
        }
    }

    fn extruded(&mut self, item: &Entity) -> Vec<Triangle> {
        let step = self.curves.step;
        let placement = axes(step, item.at(1));
        let along = triple(step, item.at(2)).and_then(unit).unwrap_or([0.0, 0.0, 1.0]);
        let Some(depth) = item.at(3).number() else { return Vec::new() };
        let found = profiles(&self.curves, item.at(0));
        self.count_unknown(found.is_empty(), item.at(0));
        found.iter().flat_map(|profile| extrude(&profile.rings, &placement, scale(along, depth))).collect()
    }

    fn revolved(&mut self, item: &Entity) -> Vec<Triangle> {
        let placement = axes(self.curves.step, item.at(1));
        let axis = axes(self.curves.step, item.at(2));
        let Some(turn) = item.at(3).number() else { return Vec::new() };
        let found = profiles(&self.curves, item.at(0));
        self.count_unknown(found.is_empty(), item.at(0));
        let turn = turn * self.curves.radian;
        found.iter().flat_map(|profile| revolve(&profile.rings, &placement, &axis, turn)).collect()
    }

    fn count_unknown(&mut self, is_unknown: bool, profile: &Value) {
        if is_unknown && let Some(profile) = self.curves.step.follow(profile) {
            *self.unknown.entry(profile.kind.clone()).or_default() += 1;
        }
    }

    fn block(&mut self, item: &Entity) -> Vec<Triangle> {
        let [Some(x), Some(y), Some(z)] = [1, 2, 3].map(|k| item.at(k).number()) else { return Vec::new() };
        let ring = vec![[0.0; 3], [x, 0.0, 0.0], [x, y, 0.0], [0.0, y, 0.0]];
        extrude(&[ring], &axes(self.curves.step, item.at(0)), [0.0, 0.0, z])
    }

    fn shell(&self, shell: &Entity) -> Vec<Triangle> {
        let step = self.curves.step;
        let ring = |bound: &Value| {
            let bound = step.follow(bound)?;
            let wire = step.follow(bound.at(0)).filter(|wire| wire.kind == "IFCPOLYLOOP")?;
            let points = wire.at(0).list().iter().map(|point| triple(step, point));
            let mut points: Vec<Vec3> = points.collect::<Option<_>>()?;
            if bound.at(1).is("F") {
                points.reverse();
            }
            Some((bound.kind == "IFCFACEOUTERBOUND", points))
        };
        let of = |face_entity: &Value| {
            let mut rings: Vec<(bool, Vec<Vec3>)> =
                step.follow(face_entity)?.at(0).list().iter().filter_map(ring).collect();
            rings.sort_by_key(|(is_outer, _)| !is_outer);
            Some(face(&rings.into_iter().map(|(_, points)| points).collect::<Vec<_>>()))
        };
        shell.at(0).list().iter().filter_map(of).flatten().collect()
    }

    /// The points of an `IfcCartesianPointList3D`.
    fn point_list(&self, value: &Value) -> Vec<Vec3> {
        let Some(list) = self.curves.step.follow(value) else { return Vec::new() };
        let point = |value: &Value| <[f64; 3]>::try_from(value.numbers()).ok();
        list.at(0).list().iter().filter_map(point).collect()
    }

    fn triangulated(&self, item: &Entity) -> Vec<Triangle> {
        let points = self.point_list(item.at(0));
        // With renumbered points, indices lead into that list first.
        let renumbered = item.at(4).numbers();
        let corner = |index: &f64| {
            let at = (*index as usize).checked_sub(1)?;
            let at =
                if renumbered.is_empty() { at } else { (*renumbered.get(at)? as usize).checked_sub(1)? };
            points.get(at).copied()
        };
        let triangle = |value: &Value| match value.numbers()[..] {
            [a, b, c] => Some([corner(&a)?, corner(&b)?, corner(&c)?]),
            _ => None,
        };
        item.at(3).list().iter().filter_map(triangle).collect()
    }

    fn polygonal(&self, item: &Entity) -> Vec<Triangle> {
        let points = self.point_list(item.at(0));
        let renumbered = item.at(3).numbers();
        let corner = |index: &f64| {
            let at = (*index as usize).checked_sub(1)?;
            let at =
                if renumbered.is_empty() { at } else { (*renumbered.get(at)? as usize).checked_sub(1)? };
            points.get(at).copied()
        };
        let ring = |value: &Value| value.numbers().iter().filter_map(corner).collect::<Vec<_>>();
        let of = |value: &Value| {
            let polygon = self.curves.step.follow(value)?;
            let holes = polygon.at(1).list().iter().map(ring);
            Some(face(&std::iter::once(ring(polygon.at(0))).chain(holes).collect::<Vec<_>>()))
        };
        item.at(2).list().iter().filter_map(of).flatten().collect()
    }

    fn mapped(&mut self, item: &Entity, depth: usize) -> Vec<Triangle> {
        let step = self.curves.step;
        let Some(source) = step.follow(item.at(0)) else { return Vec::new() };
        let placement = operator(step, item.at(1)).after(&axes(step, source.at(0)));
        let Some(shape) = step.follow(source.at(1)) else { return Vec::new() };
        let parts: Vec<Triangle> =
            shape.at(3).list().iter().flat_map(|part| self.nested(part, depth + 1)).collect();
        placed(&parts, &placement)
    }

    fn boolean(&mut self, item: &Entity, depth: usize) -> Vec<Triangle> {
        let first = self.nested(item.at(1), depth + 1);
        if self.cuts == Cuts::Left {
            return first;
        }
        let second = self.operand(item.at(2), &first, depth + 1);
        let near = NEAR_M / self.meter;
        match item.at(0) {
            operator if operator.is("DIFFERENCE") => difference(&first, &second, near),
            operator if operator.is("INTERSECTION") => intersection(&first, &second, near),
            _ => [first, second].concat(),
        }
    }

    /// A half space as a body that reaches beyond what it cuts; any other item as it is.
    fn operand(&mut self, value: &Value, cut: &[Triangle], depth: usize) -> Vec<Triangle> {
        let step = self.curves.step;
        let Some(item) = step.follow(value) else { return Vec::new() };
        if !item.kind.contains("HALFSPACE") {
            return self.nested(value, depth);
        }
        let Some(plane) = step.follow(item.at(0)).filter(|surface| surface.kind == "IFCPLANE") else {
            *self.unknown.entry(format!("{} without a plane", item.kind)).or_default() += 1;
            return Vec::new();
        };
        let frame = axes(step, plane.at(0));
        // The normal points away from the material where they agree.
        let outward = if item.at(1).is("F") { scale(frame.axes[2], -1.0) } else { frame.axes[2] };
        let half = half_space(frame.origin, outward, cut);
        if item.kind != "IFCPOLYGONALBOUNDEDHALFSPACE" {
            return half;
        }
        let Some(ring) = self.curves.ring(item.at(3)) else { return half };
        let bounds = axes(step, item.at(2));
        let far = cut.iter().chain(&half).flatten().flat_map(|p| p.map(f64::abs)).fold(1.0, f64::max);
        let start = Placement { origin: bounds.point([0.0, 0.0, -3.0 * far]), ..bounds };
        let prism = extrude(&[ring], &start, [0.0, 0.0, 6.0 * far]);
        intersection(&prism, &half, NEAR_M / self.meter)
    }
}

/// Triangles in another frame; a mirror does not turn them inside out.
pub(crate) fn placed(body: &[Triangle], placement: &Placement) -> Vec<Triangle> {
    let place = |triangle: &Triangle| {
        let [a, b, c] = triangle.map(|corner| placement.point(corner));
        if placement.is_mirrored() { [a, c, b] } else { [a, b, c] }
    };
    body.iter().map(place).collect()
}

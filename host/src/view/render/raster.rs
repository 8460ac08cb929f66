//! Triangles to pixels: a z-buffer, flat light, several samples a pixel. No randomness and no library of
//! transcendental functions, so the same scene gives the same picture on any machine and any number of
//! threads.

use biplane_geometry::vec3::{dot, minus, scaled, unit};
use rayon::prelude::*;

use super::camera::Camera;
use super::scene::{Facet, Scene};
use super::vector::Vec3;
use crate::model::palette::Rgb;

/// Samples along each side of a pixel.
const SAMPLES: usize = 3;
/// Rows of samples that one task paints.
const BAND: usize = 48;
/// Half the width of a border line, samples.
const HALF_LINE: f64 = 1.6;
/// A line is drawn over surfaces that are at most this much nearer, relative to its depth.
const LINE_LIFT: f64 = 0.004;
/// Borders of surfaces seen edge-on are drawn too: the walls of a plan.
const EDGE_ON: f64 = -0.05;
const BACKGROUND: [f32; 3] = [255.0; 3];
const LINE: [f32; 3] = [52.0, 56.0, 66.0];
/// How much of a line's color shows, at most and at least; in between it falls with the size of a meter in
/// the picture, so that small detail far away does not turn black.
const LINE_STRENGTH: [f32; 2] = [0.75, 0.12];
/// Pixels a meter from which on lines have their full strength.
const LINE_FULL_PIXELS: f64 = 45.0;

/// What is drawn of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Style {
    /// Leave out surfaces that turn their back: from outside one then looks into rooms.
    pub cull_backs: bool,
}

/// A finished picture, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels.
    pub pixels: Vec<Rgb>,
}

/// A corner in the picture's samples, with nearness.
type Corner = [f64; 3];

struct Shape {
    corners: [Corner; 3],
    color: [f32; 3],
}

struct Line {
    ends: [Corner; 2],
    strength: f32,
}

struct Samples {
    width: usize,
    nearness: Vec<f64>,
    color: Vec<[f32; 3]>,
}

/// Which part of a picture surfaces cover that are at least so far away, meters.
pub(crate) fn covered(scene: &Scene, camera: &Camera, size: [usize; 2], nearest_m: f64) -> f64 {
    let style = Style { cull_backs: false };
    let mut samples = Samples::new(size[0], size[1]);
    for facet in &scene.facets {
        for shape in shapes_of(facet, camera, size, style) {
            samples.paint(&shape, 0..size[1]);
        }
    }
    let far = |nearness: &&f64| **nearness > 0.0 && camera.depth_of(**nearness) >= nearest_m;
    samples.nearness.iter().filter(far).count() as f64 / samples.nearness.len().max(1) as f64
}

/// Draws a scene.
pub(crate) fn draw(scene: &Scene, camera: &Camera, [width, height]: [usize; 2], style: Style) -> Picture {
    let size = [width * SAMPLES, height * SAMPLES];
    let shapes: Vec<Shape> =
        scene.facets.par_iter().flat_map_iter(|facet| shapes_of(facet, camera, size, style)).collect();
    let faces_us = |index: usize| {
        let [a, _] = scene.lines_m[index];
        !style.cull_backs || dot(scene.line_normals[index], unit(camera.towards(a))) > EDGE_ON
    };
    let lines: Vec<Line> = (0..scene.lines_m.len())
        .filter(|&index| faces_us(index))
        .filter_map(|index| camera.clip_segment(scene.lines_m[index]))
        .map(|ends| line_of(ends, camera, size))
        .collect();
    let bands: Vec<Samples> = (0..size[1].div_ceil(BAND))
        .into_par_iter()
        .map(|band| {
            let rows = band * BAND..(band * BAND + BAND).min(size[1]);
            let mut samples = Samples::new(size[0], rows.len());
            shapes.iter().for_each(|shape| samples.paint(shape, rows.clone()));
            lines.iter().for_each(|line| samples.paint_line(line, camera, rows.clone()));
            samples
        })
        .collect();
    resolve(&bands, [width, height])
}

fn shapes_of(facet: &Facet, camera: &Camera, size: [usize; 2], style: Style) -> Vec<Shape> {
    let towards = camera.towards(facet.corners_m[0]);
    if style.cull_backs && dot(facet.facing, towards) <= 0.0 {
        return Vec::new();
    }
    let color = lit(facet, camera, dot(facet.normal, towards) > 0.0);
    let corners: Vec<Corner> =
        camera.clip(&facet.corners_m).into_iter().map(|corner| place(camera, corner, size)).collect();
    (1..corners.len().saturating_sub(1))
        .map(|index| Shape { corners: [corners[0], corners[index], corners[index + 1]], color })
        .collect()
}

fn line_of(ends: [Vec3; 2], camera: &Camera, size: [usize; 2]) -> Line {
    let ends = ends.map(|end| place(camera, end, size));
    let pixels = (size[0] / SAMPLES) as f64 * camera.size_of_meter((ends[0][2] + ends[1][2]) / 2.0);
    let [maximum, minimum] = LINE_STRENGTH;
    let strength = (maximum * (pixels / LINE_FULL_PIXELS) as f32).clamp(minimum, maximum);
    Line { ends, strength }
}

fn place(camera: &Camera, point_m: Vec3, [width, height]: [usize; 2]) -> Corner {
    let seen = camera.see(point_m);
    let unit = width as f64;
    [width as f64 / 2.0 + seen.x * unit, height as f64 / 2.0 - seen.y * unit, seen.nearness]
}

/// Light from above left of the camera, light from the sky, and some from the camera itself.
fn lit(facet: &Facet, camera: &Camera, faces_us: bool) -> [f32; 3] {
    let normal = if faces_us { facet.normal } else { scaled(facet.normal, -1.0) };
    let lamp = unit(minus(
        minus(scaled(camera.up(), 1.1), scaled(camera.right(), 0.7)),
        scaled(camera.forward(), 0.6),
    ));
    let key = dot(normal, lamp).max(0.0);
    let sky = 0.5 + 0.5 * normal[2];
    let head = dot(normal, scaled(camera.forward(), -1.0)).max(0.0);
    let light = (0.68 + 0.20 * key + 0.05 * sky + 0.17 * head) as f32;
    facet.color.map(|channel| (f32::from(channel) * light).min(255.0))
}

impl Samples {
    fn new(width: usize, rows: usize) -> Self {
        Self { width, nearness: vec![f64::NEG_INFINITY; width * rows], color: vec![BACKGROUND; width * rows] }
    }

    /// The samples of a rectangle that lie in these rows: columns, rows.
    fn span(
        &self,
        low: [f64; 2],
        high: [f64; 2],
        rows: &std::ops::Range<usize>,
    ) -> [std::ops::Range<usize>; 2] {
        let first = |value: f64, minimum: usize| (value - 0.5).ceil().max(minimum as f64) as usize;
        let past =
            |value: f64, maximum: usize| ((value - 0.5).floor() + 1.0).clamp(0.0, maximum as f64) as usize;
        [first(low[0], 0)..past(high[0], self.width), first(low[1], rows.start)..past(high[1], rows.end)]
    }

    fn paint(&mut self, shape: &Shape, rows: std::ops::Range<usize>) {
        let [a, b, c] = shape.corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let low = [0, 1].map(|axis| a[axis].min(b[axis]).min(c[axis]));
        let high = [0, 1].map(|axis| a[axis].max(b[axis]).max(c[axis]));
        let [columns, lines] = self.span(low, high, &rows);
        for y in lines {
            for x in columns.clone() {
                let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
                let of_b = ((px - a[0]) * (c[1] - a[1]) - (py - a[1]) * (c[0] - a[0])) / area;
                let of_c = ((b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])) / area;
                if of_b < 0.0 || of_c < 0.0 || of_b + of_c > 1.0 {
                    continue;
                }
                let nearness = a[2] + of_b * (b[2] - a[2]) + of_c * (c[2] - a[2]);
                let sample = (y - rows.start) * self.width + x;
                if nearness > self.nearness[sample] {
                    self.nearness[sample] = nearness;
                    self.color[sample] = shape.color;
                }
            }
        }
    }

    fn paint_line(&mut self, line: &Line, camera: &Camera, rows: std::ops::Range<usize>) {
        let [a, b] = line.ends;
        let low = [0, 1].map(|axis| a[axis].min(b[axis]) - HALF_LINE);
        let high = [0, 1].map(|axis| a[axis].max(b[axis]) + HALF_LINE);
        if low.iter().chain(&high).any(|value| !value.is_finite()) {
            return;
        }
        let along = [b[0] - a[0], b[1] - a[1]];
        let length2 = (along[0] * along[0] + along[1] * along[1]).max(f64::MIN_POSITIVE);
        let [columns, lines] = self.span(low, high, &rows);
        for y in lines {
            for x in columns.clone() {
                let from = [x as f64 + 0.5 - a[0], y as f64 + 0.5 - a[1]];
                let part = ((from[0] * along[0] + from[1] * along[1]) / length2).clamp(0.0, 1.0);
                let off = [from[0] - part * along[0], from[1] - part * along[1]];
                if off[0] * off[0] + off[1] * off[1] > HALF_LINE * HALF_LINE {
                    continue;
                }
                let sample = (y - rows.start) * self.width + x;
                let nearness = a[2] + part * (b[2] - a[2]);
                if self.shows(sample, nearness, camera) {
                    let under = self.color[sample];
                    self.color[sample] =
                        [0, 1, 2].map(|i: usize| under[i] + line.strength * (LINE[i] - under[i]));
                    // Marked, so that lines that cross don't darken each other.
                    self.nearness[sample] = f64::INFINITY;
                }
            }
        }
    }

    /// Whether something of this nearness would be seen at a sample, or lies on the surface seen there.
    fn shows(&self, sample: usize, nearness: f64, camera: &Camera) -> bool {
        let there = self.nearness[sample];
        if there == f64::INFINITY {
            return false;
        }
        if there == f64::NEG_INFINITY {
            return true;
        }
        let (depth_m, there_m) = (camera.depth_of(nearness), camera.depth_of(there));
        depth_m <= there_m + LINE_LIFT * depth_m.abs().max(1.0) * 2.0
    }
}

/// Samples to pixels.
fn resolve(bands: &[Samples], [width, height]: [usize; 2]) -> Picture {
    let row = |y: usize| {
        let band = &bands[y / BAND];
        let first = (y % BAND) * band.width;
        &band.color[first..first + band.width]
    };
    let mut pixels = vec![[0; 3]; width * height];
    pixels.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, line)| {
        for (x, pixel) in line.iter_mut().enumerate() {
            let mut sum = [0.0_f32; 3];
            for dy in 0..SAMPLES {
                for color in &row(y * SAMPLES + dy)[x * SAMPLES..(x + 1) * SAMPLES] {
                    for channel in 0..3 {
                        sum[channel] += color[channel];
                    }
                }
            }
            *pixel = sum.map(|value| (value / (SAMPLES * SAMPLES) as f32 + 0.5) as u8);
        }
    });
    Picture { width, height, pixels }
}

#[cfg(test)]
mod tests {
    use super::{Style, draw};
    use crate::view::render::camera::{Camera, Lens};
    use crate::view::render::scene::{Facet, Scene};

    fn square(x_m: f64, side_m: f64, towards_us: bool, color: [u8; 3]) -> [Facet; 2] {
        let s = side_m / 2.0;
        let [a, b, c, d] = [[x_m, s, -s], [x_m, -s, -s], [x_m, -s, s], [x_m, s, s]];
        let normal = [if towards_us { -1.0 } else { 1.0 }, 0.0, 0.0];
        [[a, b, c], [a, c, d]].map(|corners_m| Facet { corners_m, normal, facing: normal, color })
    }

    #[test]
    fn the_nearest_surface_is_seen_and_backs_are_left_out_when_asked() {
        let lens = Lens::Perspective { width: 1.0 };
        let camera = Camera::new([0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], lens);
        let mut scene = Scene::default();
        scene.facets.extend(square(4.0, 2.0, true, [255, 0, 0]));
        scene.facets.extend(square(2.0, 0.5, true, [0, 255, 0]));
        scene.facets.extend(square(1.0, 0.125, false, [0, 0, 255]));
        let strongest = |cull_backs: bool, x: usize| {
            let picture = draw(&scene, &camera, [64, 64], Style { cull_backs });
            let [r, g, b] = picture.pixels[32 * 64 + x];
            if r > 200 && g > 200 {
                'w'
            } else if r > g.max(b) {
                'r'
            } else if g > b {
                'g'
            } else {
                'b'
            }
        };
        // Half of the picture is 32 pixels wide: the far square reaches 16 of them, the middle one 8, the
        // near one 4.
        assert_eq!([0, 18, 26, 30].map(|x| strongest(false, x)), ['w', 'r', 'g', 'b']);
        assert_eq!([0, 18, 26, 30].map(|x| strongest(true, x)), ['w', 'r', 'g', 'g']);
    }

    #[test]
    fn a_line_shows_on_its_surface_and_not_through_a_nearer_one() {
        // 64 pixels over 1.4 m: lines have their full strength.
        let lens = Lens::Parallel { width_m: 1.4 };
        let camera = Camera::new([0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], lens);
        let mut scene = Scene::default();
        scene.facets.extend(square(4.0, 1.4, true, [200, 200, 200]));
        scene.facets.extend(square(2.0, 0.35, true, [200, 200, 200]));
        scene.lines_m.push([[4.0, 0.7, 0.0], [4.0, -0.7, 0.0]]);
        scene.line_normals.push([-1.0, 0.0, 0.0]);
        let picture = draw(&scene, &camera, [64, 64], Style { cull_backs: true });
        let dark = |x: usize| (31..=32).any(|y| picture.pixels[y * 64 + x][0] < 140);
        assert!(dark(4) && dark(60) && !dark(32));
    }
}

//! What a laser of today measures: a fan of beams whose directions, times and number a telegram states.

/// A fan that is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fan {
    /// When its first beam is taken, nanoseconds.
    pub first_beam_ns: i64,
    /// From a beam to the next, nanoseconds; no whole number.
    pub beam_ns: f64,
    /// Direction of the first beam, radians counter-clockwise from straight ahead.
    pub first_rad: f64,
    /// From a beam to the next, radians.
    pub step_rad: f64,
    /// Beams.
    pub count: u16,
}

impl Fan {
    /// Time and direction of each beam.
    pub fn beams(&self) -> impl Iterator<Item = (i64, f64)> + use<> {
        let fan = *self;
        (0..fan.count).map(move |beam| {
            let beam = f64::from(beam);
            let time_ns = fan.first_beam_ns + (beam * fan.beam_ns).round() as i64;
            (time_ns, fan.first_rad + beam * fan.step_rad)
        })
    }

    /// The same fan, so much later.
    #[must_use]
    pub fn later(self, by_ns: i64) -> Self {
        Self { first_beam_ns: self.first_beam_ns.saturating_add(by_ns), ..self }
    }
}

/// Gives a laser the ranges of a fan in millimeters, 0 for no echo.
pub type FanSource = Box<dyn FnMut(&Fan) -> Vec<u16> + Send>;

//! What a stage tells of its parameters: name, meaning, range, and the value by name.
//!
//! A stage declares its struct of parameters with `parameter_group!`, whose doc comments are the only
//! description there is; `params` collects the groups. Names are `stage.field` with the unit at the end.
//! Numbers pass as `f64`; counts must be whole.

/// One parameter, whatever its value.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Parameter {
    /// `stage.field`.
    pub name: &'static str,
    /// What it is and what it trades.
    pub meaning: &'static str,
    /// The smallest value that makes sense.
    pub minimum: f64,
    /// The largest value that makes sense.
    pub maximum: f64,
    /// Whether it counts something.
    pub whole: bool,
}

/// A stage's struct of parameters by name.
pub(crate) trait ParameterGroup {
    /// The group's parameters, in the order of the fields.
    fn parameters() -> &'static [Parameter]
    where
        Self: Sized;
    /// A value, when the group has a parameter of this name.
    fn get(&self, name: &str) -> Option<f64>;
    /// Changes a value, when the group has a parameter of this name; the value is one that makes sense.
    fn set(&mut self, name: &str, value: f64);
}

/// Most that a count may be, where the field says nothing else: memory is made for some of them.
pub(crate) const MAXIMUM: f64 = 1e5;

/// Declares a stage's parameters: the struct as it would stand without, `name: type` or `name: type [least,
/// most]`, after the stage's name. Fields after `not by name:` are for callers of the library; no name sets
/// them.
macro_rules! parameter_group {
    (@range) => { [0.0, crate::parameter_group::MAXIMUM] };
    (@range [$minimum:expr, $maximum:expr]) => { [$minimum, $maximum] };
    ($stage:literal; $(#[$meta:meta])* pub struct $params:ident {
        $($(#[doc = $doc:literal])+ pub $field:ident : $kind:tt $([$minimum:expr, $maximum:expr])?,)+
        $(not by name: $($(#[doc = $hidden_doc:literal])+ pub $hidden:ident : $hidden_kind:tt,)+)?
    }) => {
        $(#[$meta])*
        pub struct $params {
            $($(#[doc = $doc])+ pub $field: $kind,)+
            $($($(#[doc = $hidden_doc])+ pub $hidden: $hidden_kind,)+)?
        }

        impl crate::parameter_group::ParameterGroup for $params {
            fn parameters() -> &'static [crate::parameter_group::Parameter] {
                const PARAMETERS: &[crate::parameter_group::Parameter] = &[$({
                    let [minimum, maximum] =
                        crate::parameter_group::parameter_group!(@range $([$minimum, $maximum])?);
                    crate::parameter_group::Parameter {
                        name: concat!($stage, ".", stringify!($field)),
                        meaning: concat!($($doc),+).trim_ascii(),
                        minimum,
                        maximum,
                        whole: <$kind as crate::parameter_group::Number>::WHOLE,
                    }
                }),+];
                PARAMETERS
            }

            fn get(&self, name: &str) -> Option<f64> {
                match name {
                    $(concat!($stage, ".", stringify!($field)) => Some(self.$field as f64),)+
                    _ => None,
                }
            }

            fn set(&mut self, name: &str, value: f64) {
                match name {
                    $(concat!($stage, ".", stringify!($field)) => {
                        self.$field = <$kind as crate::parameter_group::Number>::from_f64(value);
                    })+
                    _ => {}
                }
            }
        }
    };
}
pub(crate) use parameter_group;

/// The types of parameters.
pub(crate) trait Number {
    /// Whether only whole numbers are values.
    const WHOLE: bool;
    /// The value; the caller has made sure that it is one.
    fn from_f64(value: f64) -> Self;
}

impl Number for f64 {
    const WHOLE: bool = false;
    fn from_f64(value: f64) -> Self {
        value
    }
}

macro_rules! counts {
    ($($kind:ident),*) => { $(impl Number for $kind {
        const WHOLE: bool = true;
        fn from_f64(value: f64) -> Self {
            value as $kind
        }
    })* };
}
counts!(usize, u32);

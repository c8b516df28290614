//! Parameters of the methods: one plain struct each, and a table of its fields for whoever sets them by name.

use crate::error::{Error, Result};

/// One parameter of a method `P`.
#[derive(Debug)]
pub(crate) struct Parameter<P> {
    /// Its name, as in the struct and in files.
    pub(crate) name: &'static str,
    /// What it does, and its unit.
    pub(crate) doc: &'static str,
    /// Least value.
    pub(crate) low: f32,
    /// Largest value.
    pub(crate) high: f32,
    /// Whether it counts something.
    pub(crate) whole: bool,
    /// Reads it.
    pub(crate) get: fn(&P) -> f32,
    /// Writes it, unchecked.
    pub(crate) set: fn(&mut P, f32),
}

/// Parameters that can be listed, read and written by name.
pub(crate) trait Parameters: Sized + Default + 'static {
    /// All of them.
    const PARAMETERS: &'static [Parameter<Self>];

    /// Sets one by name.
    ///
    /// # Errors
    /// When there is no such parameter, or the value is NaN, out of range, or a fraction of something counted.
    fn set(&mut self, name: &str, value: f32) -> Result<()> {
        let Some(parameter) = Self::PARAMETERS.iter().find(|parameter| parameter.name == name) else {
            let names: Vec<_> = Self::PARAMETERS.iter().map(|parameter| parameter.name).collect();
            return Err(Error::value("parameter", format!("one of {}", names.join(", ")), name));
        };
        parameter.check(value)?;
        (parameter.set)(self, value);
        Ok(())
    }

    /// The parameters after a check of every one.
    ///
    /// # Errors
    /// Names the parameter, its range and what was found.
    fn checked(self) -> Result<Self> {
        Self::PARAMETERS.iter().try_for_each(|parameter| parameter.check((parameter.get)(&self)))?;
        Ok(self)
    }
}

impl<P> Parameter<P> {
    fn check(&self, value: f32) -> Result<()> {
        let (low, high) = (self.low, self.high);
        if (low..=high).contains(&value) && (!self.whole || value.fract() == 0.0) {
            return Ok(());
        }
        let kind = if self.whole { "a whole number" } else { "a number" };
        Err(Error::value(self.name, format!("{kind} in {low}..={high}"), value))
    }
}

/// A params struct: fields with type, default and range. `u32` fields count something.
macro_rules! params {
    (
        $(#[doc = $about:literal])*
        $name:ident {
            $(
                $(#[doc = $doc:literal])* $(#[serde($serde:ident)])?
                $field:ident: $type:ident = $default:literal in $low:literal..=$high:literal,
            )*
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[doc = $doc])*
                #[doc = concat!(" Default ", stringify!($default), "; ", stringify!($low), " to ", stringify!($high), ".")]
                $(#[serde($serde)])?
                pub $field: $type,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl $crate::search::params::Parameters for $name {
            const PARAMETERS: &'static [$crate::search::params::Parameter<Self>] = &[$(
                $crate::search::params::Parameter {
                    name: stringify!($field),
                    doc: concat!($($doc),*),
                    low: $low as f32,
                    high: $high as f32,
                    whole: $crate::search::params::is_whole(stringify!($type)),
                    get: |p| p.$field as f32,
                    set: |p, value| p.$field = value as $type,
                },
            )*];
        }
    };
}
pub(crate) use params;

/// The same with the parameters of the filter that runs after every method.
macro_rules! filtered_params {
    ($(#[doc = $about:literal])* $name:ident { $($fields:tt)* }) => {
        $crate::search::params::params! {
            $(#[doc = $about])*
            $name {
                $($fields)*
                /// Passes of the edge-aware 5x5 filter.
                denoise_passes: u32 = 1 in 0..=4,
                /// Distance of a neighbour from the pixel's plane at which it stops counting (share of the AO radius).
                denoise_plane: f32 = 0.05 in 0.001..=2.0,
                /// Exponent on the cosine between the normals.
                denoise_normal: f32 = 4.0 in 0.0..=64.0,
                /// If above 0, a last pass of the filter removes what is left of the noise: visibilities that differ less from their
                /// neighbours' mean come nearer to it.
                #[serde(default)]
                denoise_keep: f32 = 0.0 in 0.0..=1.0,
            }
        }

        impl $name {
            pub(crate) const fn denoise(&self) -> $crate::search::Denoise {
                $crate::search::Denoise {
                    passes: self.denoise_passes,
                    plane: self.denoise_plane,
                    normal: self.denoise_normal,
                    keep: self.denoise_keep,
                }
            }
        }
    };
}
pub(crate) use filtered_params;

pub(crate) const fn is_whole(type_name: &str) -> bool {
    matches!(type_name.as_bytes(), b"u32")
}

#[cfg(test)]
#[allow(unreachable_pub, reason = "the macro makes public structs")]
mod tests {
    use super::*;

    params! {
        /// For tests.
        Toy {
            /// Rays.
            rays: u32 = 4 in 1..=16,
            /// Thickness (share of the radius).
            thickness: f32 = 0.5 in 0.0..=1.0,
        }
    }

    #[test]
    fn values_are_set_by_name_within_their_range() {
        let mut toy = Toy::default();
        assert_eq!(toy, Toy { rays: 4, thickness: 0.5 });
        toy.set("rays", 8.0).unwrap();
        toy.set("thickness", 0.0).unwrap();
        assert_eq!(toy, Toy { rays: 8, thickness: 0.0 });
        for (name, value, word) in [
            ("rays", 0.0, "1..=16"),
            ("rays", 1.5, "whole"),
            ("rays", f32::NAN, "NaN"),
            ("thickness", f32::NAN, "thickness"),
            ("thickness", f32::INFINITY, "inf"),
            ("colour", 1.0, "rays, thickness"),
        ] {
            let error = toy.set(name, value).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
        assert!(Toy { thickness: 2.0, ..toy }.checked().is_err());
        assert!(Toy { rays: 0, ..toy }.checked().unwrap_err().to_string().contains("rays"));
    }
}

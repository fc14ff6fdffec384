//! Lists of all variants of an enum that the compiler keeps complete.
//!
//! A list whose variants are written out compiles without a variant that is added later. This
//! macro matches the listed variants too, so that a forgotten one does not compile.

/// An array of all variants of an enum, in the given order; or of pairs of a name and a variant, in
/// either order.
#[macro_export]
macro_rules! all_variants {
    ($($Enum:ident::$Variant:ident $(($Inner:ident::$Of:ident))?),+ $(,)?) => {{
        const fn listed(variant: &$crate::variants::first_of!($($Enum)+)) {
            match variant { $($Enum::$Variant $(($Inner::$Of))? => {})+ }
        }
        let all = [$($Enum::$Variant $(($Inner::$Of))?),+];
        listed(&all[0]);
        all
    }};
    ($(($name:literal, $Enum:ident::$Variant:ident)),+ $(,)?) => {{
        const fn listed(variant: &$crate::variants::first_of!($($Enum)+)) {
            match variant { $($Enum::$Variant => {})+ }
        }
        let all = [$(($name, $Enum::$Variant)),+];
        listed(&all[0].1);
        all
    }};
    ($(($Enum:ident::$Variant:ident, $name:literal)),+ $(,)?) => {{
        const fn listed(variant: &$crate::variants::first_of!($($Enum)+)) {
            match variant { $($Enum::$Variant => {})+ }
        }
        let all = [$(($Enum::$Variant, $name)),+];
        listed(&all[0].0);
        all
    }};
}

/// The first of several names.
#[macro_export]
macro_rules! first_of {
    ($first:ident $($rest:ident)*) => {
        $first
    };
}

pub use {all_variants, first_of};

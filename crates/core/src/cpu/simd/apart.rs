//! Functions that kernels call often and that cost more than their call: compiled once for a register type, not into each of their callers.

/// Declares the arguments of such a function and what it does with them; [`Lane::apart`](super::lane::Lane::apart) runs it. The function
/// that others call has a name, `f`, and its body is `f_apart`, which stands behind it.
macro_rules! apart {
    ($name:ident<$life:lifetime, $lane:ident: $bound:path>($($field:ident: $argument:ty),*) -> $result:ty, $body:expr) => {
        struct $name<$life, $lane: $bound> {
            $($field: $argument),*
        }

        impl<$life, $lane: $bound> pulp::WithSimd for $name<$life, $lane> {
            type Output = $result;

            #[inline(always)]
            fn with_simd<S: pulp::Simd>(self, _: S) -> $result {
                let Self { $($field),* } = self;
                $body
            }
        }
    };
}
pub(in crate::cpu) use apart;

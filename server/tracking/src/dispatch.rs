//! Functions in two versions: for any processor, and for one with wide vectors (AVX2) and a bit-counting instruction.
//!
//! Both are compiled from the same source, which is written so that the compiler vectorises it, so they give the same bits.
//! Which one runs is decided when it is called.

/// `fn name(arguments) -> Result = body_function;` makes `name` the wider version of `body_function`, which must be
/// `#[inline(always)]`, or that function itself where the processor has no wide vectors.
macro_rules! dispatch {
    (
        $(#[$attribute:meta])*
        $visibility:vis fn $name:ident($($argument:ident: $type:ty),*) $(-> $result:ty)? = $portable:ident;
    ) => {
        $(#[$attribute])*
        $visibility fn $name($($argument: $type),*) $(-> $result)? {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2,popcnt")]
                fn wide($($argument: $type),*) $(-> $result)? {
                    $portable($($argument),*)
                }
                if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt") {
                    // SAFETY: the processor has what `wide` is compiled for, as was just seen.
                    #[expect(unsafe_code, reason = "the one way to call code for a detected processor")]
                    return unsafe { wide($($argument),*) };
                }
            }
            $portable($($argument),*)
        }
    };
}

pub(crate) use dispatch;

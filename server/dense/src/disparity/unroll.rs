//! Unrolling of the kernels that keep all disparities of a pixel in registers.
//!
//! An array in registers needs constant indices. The WGSL compiler puts a counter into every loop, so that hostile
//! loops end, and behind it no driver unrolls: on a software GPU the array then lies in memory, at twice the time.
//! So the lines between `// unroll` and `// end unroll`, a block with `const GROUP = 0u;`, are repeated as text for
//! each group of 16 disparities. A kernel file as it stands is the valid kernel for one group.

use std::sync::OnceLock;

/// Most groups of 16 disparities.
pub(super) const GROUPS_MAX: usize = 20;

/// A kernel's text for every number of groups, made when first asked for.
pub(super) struct UnrolledText {
    wgsl: &'static str,
    texts: [OnceLock<String>; GROUPS_MAX],
}

impl UnrolledText {
    pub const fn new(wgsl: &'static str) -> Self {
        Self { wgsl, texts: [const { OnceLock::new() }; GROUPS_MAX] }
    }

    /// The kernel for `groups` groups, 1 to [`GROUPS_MAX`].
    pub fn text(&'static self, groups: u32) -> &'static str {
        let place = (groups as usize).clamp(1, GROUPS_MAX);
        self.texts[place - 1].get_or_init(|| unroll(self.wgsl, place))
    }
}

fn unroll(wgsl: &str, groups: usize) -> String {
    let mut unrolled = String::with_capacity(wgsl.len() * groups);
    let mut block: Option<String> = None;
    for line in wgsl.lines() {
        match (line.trim(), &mut block) {
            ("// unroll", None) => block = Some(String::new()),
            ("// end unroll", Some(body)) => {
                for group in 0..groups {
                    unrolled += &body.replace("const GROUP = 0u;", &format!("const GROUP = {group}u;"));
                }
                block = None;
            }
            (_, Some(body)) => push_line(body, line),
            ("const GROUPS = 1u;", None) => push_line(&mut unrolled, &format!("const GROUPS = {groups}u;")),
            (_, None) => push_line(&mut unrolled, line),
        }
    }
    unrolled
}

fn push_line(text: &mut String, line: &str) {
    text.push_str(line);
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_repeated_with_its_number() {
        let kernel = "const GROUPS = 1u;\na\n// unroll\n{ const GROUP = 0u; }\n// end unroll\nb";
        let expected = "const GROUPS = 2u;\na\n{ const GROUP = 0u; }\n{ const GROUP = 1u; }\nb\n";
        assert_eq!(unroll(kernel, 2), expected);
    }
}

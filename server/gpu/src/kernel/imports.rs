//! Shared WGSL: a kernel file starts with lines `#import NAME`, one for each file of `shared/` that it uses.

/// The shared files by name.
const SHARED: &[(&str, &str)] = &[
    ("view", include_str!("../shared/view.wgsl")),
    ("finite", include_str!("../shared/finite.wgsl")),
    ("color", include_str!("../shared/color.wgsl")),
    ("shading", include_str!("../shared/shading.wgsl")),
    ("surfel", include_str!("../shared/surfel.wgsl")),
    ("fusion", include_str!("../shared/fusion.wgsl")),
    ("light", include_str!("../shared/light.wgsl")),
    ("held_out", include_str!("../shared/held_out.wgsl")),
    ("graph", include_str!("../shared/graph.wgsl")),
    ("near_nodes", include_str!("../shared/near_nodes.wgsl")),
    ("binding", include_str!("../shared/binding.wgsl")),
    ("warp", include_str!("../shared/warp.wgsl")),
];

/// The complete source: imports blanked, the shared files behind the kernel's own lines, so that line numbers in
/// compiler messages are those of the kernel file.
///
/// # Errors
/// A sentence naming an import that no shared file has.
pub fn resolve_imports(wgsl: &str) -> Result<String, String> {
    let mut own = String::with_capacity(wgsl.len());
    let mut imported = Vec::new();
    for line in wgsl.lines() {
        match line.strip_prefix("#import ") {
            Some(name) => imported.push(shared(name.trim())?),
            None => own.push_str(line),
        }
        own.push('\n');
    }
    Ok(own + &imported.join("\n"))
}

fn shared(wanted: &str) -> Result<&'static str, String> {
    let found = SHARED.iter().find(|(name, _)| *name == wanted);
    found.map(|(_, wgsl)| *wgsl).ok_or_else(|| format!("imports \"{wanted}\", which is no shared WGSL file"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_import_keeps_the_line_numbers_of_the_kernel_file() {
        let resolved = resolve_imports("#import finite\nfn own() {}\n").unwrap();
        assert_eq!(resolved.lines().nth(1), Some("fn own() {}"));
        assert!(resolved.contains("fn is_finite"));
    }

    #[test]
    fn an_unknown_import_is_named() {
        assert!(resolve_imports("#import nonsense\n").unwrap_err().contains("nonsense"));
    }
}

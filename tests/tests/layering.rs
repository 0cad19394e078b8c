//! Who may depend on whom (design section 3), read from cargo's own metadata.

use std::collections::{BTreeMap, BTreeSet};

use cargo_metadata::{DependencyKind, MetadataCommand};

/// Each of our packages with the only ones of ours that it may use.
const ALLOWED: &[(&str, &[&str])] = &[
    ("geometry", &[]),
    ("protocol", &[]),
    ("gpu", &[]),
    ("settings", &[]),
    ("tracking", &["geometry"]),
    ("recording", &["geometry"]),
    ("simulator", &["geometry"]),
    ("dense", &["geometry", "gpu"]),
    ("render", &["geometry", "gpu"]),
    ("evaluation", &["geometry", "recording"]),
    ("reporting", &["evaluation", "geometry", "recording"]),
    ("connection", &["protocol"]),
    ("mis-slam-cart", &["connection", "geometry", "protocol", "recording", "settings"]),
    ("mis-slam-view", &["connection", "geometry", "gpu", "protocol", "render", "replica"]),
    ("replica", &["protocol"]),
    (
        "mis-slam",
        &[
            "dense",
            "evaluation",
            "geometry",
            "gpu",
            "mis-slam-cart",
            "mis-slam-view",
            "protocol",
            "recording",
            "render",
            "replica",
            "reporting",
            "settings",
            "simulator",
            "tracking",
        ],
    ),
    ("tracking-evaluation", &["geometry", "recording", "simulator", "tracking"]),
    (
        "tests",
        &[
            "dense",
            "evaluation",
            "geometry",
            "gpu",
            "mis-slam",
            "protocol",
            "recording",
            "replica",
            "simulator",
        ],
    ),
];

/// Libraries that stay out of a package, so that it can be used without them.
const FORBIDDEN: &[(&str, &[&str])] = &[
    ("protocol", &["tokio", "wgpu", "zenoh", "nalgebra"]),
    ("replica", &["tokio", "wgpu", "zenoh", "nalgebra"]),
    ("connection", &["wgpu", "nalgebra"]),
    ("geometry", &["tokio", "wgpu", "zenoh"]),
    ("tracking", &["tokio", "wgpu", "zenoh", "prost"]),
    ("dense", &["tokio", "zenoh", "prost"]),
    ("gpu", &["tokio", "zenoh", "nalgebra"]),
    ("render", &["tokio", "zenoh", "prost"]),
    ("recording", &["tokio", "wgpu", "zenoh"]),
    ("settings", &["tokio", "wgpu", "zenoh", "prost"]),
];

fn direct_dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let metadata = MetadataCommand::new().no_deps().exec().expect("cargo tells about the workspace");
    let of = |package: &cargo_metadata::Package| {
        let normal = package.dependencies.iter().filter(|d| d.kind != DependencyKind::Development);
        normal.map(|d| d.name.clone()).collect()
    };
    metadata.packages.iter().map(|p| (p.name.to_string(), of(p))).collect()
}

#[test]
fn packages_depend_only_in_the_documented_direction() {
    let dependencies = direct_dependencies();
    let ours: BTreeSet<&str> = dependencies.keys().map(String::as_str).collect();
    let listed: BTreeSet<&str> = ALLOWED.iter().map(|(package, _)| *package).collect();
    assert_eq!(ours, listed, "every package of the workspace is listed here");
    for (package, allowed) in ALLOWED {
        let used = dependencies[*package].iter().filter(|d| ours.contains(d.as_str()));
        let wrong: Vec<_> = used.filter(|d| !allowed.contains(&d.as_str())).collect();
        assert!(wrong.is_empty(), "{package} must not depend on {wrong:?}");
    }
}

#[test]
fn lower_layers_know_no_runtime_no_network_and_no_gpu() {
    let dependencies = direct_dependencies();
    for (package, forbidden) in FORBIDDEN {
        let wrong: Vec<_> = forbidden.iter().filter(|d| dependencies[*package].contains(**d)).collect();
        assert!(wrong.is_empty(), "{package} must not depend on {wrong:?}");
    }
}

#!/usr/bin/env bash
# Installs what MIS-SLAM needs beside a Rust toolchain and a C compiler, and builds the web page.
#
#   config/setup.sh           what the server needs to build and run
#   config/setup.sh --test    also what the tests need (Chromium, Xvfb, Python packages)
#   config/setup.sh --check   only report what is missing; exit 1 if something is
#
# Safe to run again: only what is missing is installed. Debian 12/13, Ubuntu 22.04/24.04.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

with_tests=false
check_only=false
for argument in "$@"; do
    case "$argument" in
        --test) with_tests=true ;;
        --check) check_only=true ;;
        *) sed -n '2,8p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
    esac
done

missing=0
say() { printf '[setup] %s\n' "$*"; }
have() { command -v "$1" >/dev/null 2>&1; }
as_root() { if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi; }

apt_updated=false
apt_install() {
    if ! have apt-get; then
        say "cannot install ($*): this script knows apt only; install the equivalents and run it again"
        exit 1
    fi
    if ! $apt_updated; then
        as_root apt-get update -qq
        apt_updated=true
    fi
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

# require WHAT CONDITION INSTALLER...: installs WHAT where CONDITION fails
require() {
    local what=$1 condition=$2
    shift 2
    if "$condition"; then
        say "ok: $what"
    elif $check_only; then
        say "missing: $what"
        missing=1
    else
        say "installing: $what"
        "$@"
        "$condition" || { say "$what is still missing after the installation"; exit 1; }
    fi
}

has_rust() { have cargo && have rustc; }
no_rust() { say "install Rust from https://rustup.rs (or your distribution, 1.95 or newer), then run this again"; exit 1; }

has_compiler() { have cc; }
install_compiler() { apt_install gcc libc6-dev; }

# Whether the linker finds a library. The whole list is read first: a pipe that grep leaves early
# fails under pipefail where ldconfig is still writing.
has_library() {
    local known
    known=$(PATH="$PATH:/sbin" ldconfig -p)
    grep -qF "$1" <<<"$known"
}

has_vulkan_loader() { has_library libvulkan.so.1; }
install_vulkan_loader() { apt_install libvulkan1; }

# Any driver will do; without a GPU's own driver the software one (lavapipe) is installed.
has_vulkan_driver() {
    [ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] ||
        compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null ||
        compgen -G '/usr/local/share/vulkan/icd.d/*.json' >/dev/null ||
        compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null
}
install_vulkan_driver() { apt_install mesa-vulkan-drivers; }

has_ffmpeg() { have ffmpeg && have ffprobe; }
install_ffmpeg() { apt_install ffmpeg; }

has_node() { have node && have npm && [ "$(node -p 'process.versions.node.split(".")[0]')" -ge 18 ]; }
install_node() {
    apt_install nodejs npm
    has_node || { say "this distribution's Node is older than 18: install Node 18 or newer from https://nodejs.org, then run this again"; exit 1; }
}

chromium_path() { command -v chromium || command -v chromium-browser || command -v google-chrome; }
has_chromium() { chromium_path >/dev/null; }
install_chromium() {
    if [ "$(. /etc/os-release && echo "$ID")" = ubuntu ]; then
        as_root snap install chromium   # Ubuntu ships Chromium as a snap only
    else
        apt_install chromium
    fi
}

has_xvfb() { have Xvfb; }
install_xvfb() { apt_install xvfb; }

# What a window loads when it opens.
has_x11_libraries() {
    local library
    for library in libX11.so.6 libX11-xcb.so.1 libXcursor.so.1 libXi.so.6 libxkbcommon-x11.so.0; do
        has_library "$library" || return 1
    done
}
install_x11_libraries() { apt_install libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0; }

venv=target/python
has_python_packages() { "$venv/bin/python" -c 'import cv2, mcap, mcap_protobuf, foxglove_schemas_protobuf, numpy, rosbags, scipy' 2>/dev/null; }
install_python_packages() {
    python3 -c 'import ensurepip, venv' 2>/dev/null || apt_install python3 python3-venv
    mkdir -p target
    python3 -m venv "$venv"
    "$venv/bin/python" -m pip install -q --disable-pip-version-check -r tests/compat/requirements.txt
}

page_sources_stamp() { find clients/web protocol/proto -type f -not -path '*/node_modules/*' -not -path '*/dist/*' -print0 | sort -z | xargs -0 sha256sum | sha256sum | cut -d' ' -f1; }
has_page() { [ -f clients/web/dist/index.html ] && [ "$(cat clients/web/dist/.sources 2>/dev/null)" = "$(page_sources_stamp)" ]; }
# Whether the packages installed are those of the lock file as it is now, one of which is named.
has_web_packages() { [ -d "clients/web/node_modules/$1" ] && [ clients/web/node_modules -nt clients/web/package-lock.json ]; }
web_packages() { (cd clients/web && npm ci --no-audit --no-fund --loglevel=error "$@" >/dev/null); }
build_page() {
    has_web_packages esbuild || web_packages --omit=dev
    (cd clients/web && npm run --silent build)
    page_sources_stamp >clients/web/dist/.sources
}
has_page_tools() { has_web_packages typescript; }

require "Rust toolchain" has_rust no_rust
require "C compiler" has_compiler install_compiler
require "Vulkan loader (libvulkan1)" has_vulkan_loader install_vulkan_loader
require "Vulkan driver (lavapipe where there is no GPU)" has_vulkan_driver install_vulkan_driver
require "FFmpeg (imports videos)" has_ffmpeg install_ffmpeg
require "Node 18 or newer, npm" has_node install_node
require "web page (clients/web/dist)" has_page build_page
if $with_tests; then
    require "web page tools (TypeScript, linter)" has_page_tools web_packages
    require "Chromium" has_chromium install_chromium
    require "X11 libraries for the native viewer" has_x11_libraries install_x11_libraries
    require "virtual X display (Xvfb)" has_xvfb install_xvfb
    require "Python packages ($venv)" has_python_packages install_python_packages
fi
exit $missing

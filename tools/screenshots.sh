#!/usr/bin/env bash
# Makes the pictures of docs/guide/images from the sample site: runs it, opens its report in headless Chromium, uses every
# control, and keeps what the guide shows. Needs a Chromium, and node with playwright-core where tools/browser/report.mjs
# finds it (npm install --prefix tools/browser playwright-core).
#
#   CHROMIUM=/usr/bin/chromium tools/screenshots.sh target/release/tsumu
set -euo pipefail
program="$(realpath "${1:?the built program}")"
cd "$(dirname "$0")/.."
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
"$program" run examples/breakwater --out "$work/run"
node tools/browser/report.mjs "$work/run/report.html" "$work/shots"
for name in report cut review sections; do
  size="$(stat -c %s "$work/shots/$name.jpg")"
  [ "$size" -le 300000 ] || { echo "$name.jpg has $size bytes: too large for the guide"; exit 1; }
  cp "$work/shots/$name.jpg" "docs/guide/images/$name.jpg"
done
ls -l docs/guide/images

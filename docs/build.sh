#!/usr/bin/env bash
# Makes a site of README.md and docs/ by mkdocs (Debian's package; needed for this alone).
# usage: docs/build.sh [FOLDER]   (default: .ws/docs/site)
set -euo pipefail

root=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." && pwd)
site=$(readlink -m "${1:-$root/.ws/docs/site}")
command -v mkdocs >/dev/null || { echo "error: mkdocs is not here; as root: apt-get install mkdocs" >&2; exit 2; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$root/docs/mkdocs.yml" "$work/"
cp -r "$root/docs" "$work/site_source"
rm -f "$work"/site_source/{mkdocs.yml,build.sh,generate_reference.py}
# The first page is the README: its links into docs/ are those of the site, other files of the repository are none.
sed -E 's#\]\(docs/#](#g; s#\[([^]]*)\]\((CONTRIBUTING\.md|LICENSE)\)#\1 (\2 in the repository)#g' "$root/README.md" >"$work/site_source/index.md"
# shellcheck disable=SC2016 # backquotes are Markdown's
# What a fence says beside its language stands above it on the site.
find "$work/site_source" -name '*.md' -exec sed -i -E \
  -e 's/^```(\w+) no-test: (.*)$/*Not run by the tests: \2.*\n\n```\1/' -e 's/^```(\w+) file: (.*)$/`\2`:\n\n```\1/' {} +
mkdocs build --quiet --strict --config-file "$work/mkdocs.yml" --site-dir "$site"
echo "the site's first page is $site/index.html"

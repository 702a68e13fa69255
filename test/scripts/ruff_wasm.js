// Checks Python files by ruff's WebAssembly build: node ruff_wasm.js SETTINGS_AS_JSON FILE...
// Prints a line for each finding, as ruff does, and exits with 1 where there is one.
const fs = require("fs");
const path = require("path");
const {Workspace, PositionEncoding} = require(path.join(process.env.RUFF_FOLDER, "node_modules/@astral-sh/ruff-wasm-nodejs"));

const workspace = new Workspace(JSON.parse(process.argv[2]), PositionEncoding.Utf32);
let found = 0;
for (const file of process.argv.slice(3)) {
  for (const finding of workspace.check(fs.readFileSync(file, "utf8"))) {
    const {row, column} = finding.start_location;
    console.log(`${file}:${row}:${column}: ${finding.code} ${finding.message}`);
    ++found;
  }
}
process.exit(found ? 1 : 0);

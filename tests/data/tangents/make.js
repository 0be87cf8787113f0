// Makes mikktspace.txt: meshes, and the tangents that npm's mikktspace 1.1.1 (Mikkelsen's own program, in WebAssembly)
// gives their corners. `npm install mikktspace`, then `node make.js > mikktspace.txt`.
// Of each mesh: "mesh VERTICES TRIANGLES", a line a vertex (position, normal, uv), a line a triangle (its vertices),
// a line a corner (x, y, z, w as the program has it: for v that goes up).
const { generateTangents } = require("mikktspace");

let seed = 46;
function random() {
    seed = (seed * 1664525 + 1013904223) >>> 0;
    return seed / 4294967296;
}
const below = (n) => Math.floor(random() * n);
const snapped = (x, steps) => Math.fround(steps ? Math.round(x * steps) / steps : x);

function tell({ positions, normals, uvs, indices }) {
    const each = (array, size) => indices.flatMap((i) => array.slice(size * i, size * i + size));
    const corners = [each(positions, 3), each(normals, 3), each(uvs, 2)].map((a) => Float32Array.from(a));
    const tangents = Array.from(generateTangents(...corners));
    console.log(`mesh ${positions.length / 3} ${indices.length / 3}`);
    const row = (...numbers) => console.log(numbers.map((x) => +x.toPrecision(9)).join(" "));
    for (let v = 0; v < positions.length / 3; ++v)
        row(...positions.slice(3 * v, 3 * v + 3), ...normals.slice(3 * v, 3 * v + 3), ...uvs.slice(2 * v, 2 * v + 2));
    for (let t = 0; t < indices.length; t += 3) row(...indices.slice(t, t + 3));
    for (let c = 0; c < indices.length; ++c) row(...tangents.slice(4 * c, 4 * c + 4));
}

// The program does not sort the edges of the highest vertices; a triangle far away takes that place.
function withLast(mesh) {
    const v = mesh.positions.length / 3;
    mesh.positions.push(50, 0, 0, 51, 0, 0, 50, 1, 0);
    mesh.normals.push(0, 0, 1, 0, 0, 1, 0, 0, 1);
    mesh.uvs.push(0, 0, 1, 0, 0, 1);
    mesh.indices.push(v, v + 1, v + 2);
    return mesh;
}

// Any triangles among a few vertices: with edges of many triangles, triangles that are lines or that the image covers
// in a line, mirrored images.
function soup(vertices, triangles, steps, uvSteps) {
    const mesh = { positions: [], normals: [], uvs: [], indices: [] };
    for (let v = 0; v < vertices; ++v) {
        for (let k = 0; k < 3; ++k) mesh.positions.push(snapped(2 * random() - 1, steps));
        const n = [0, 1, 2].map(() => 2 * random() - 1), length = Math.hypot(...n);
        mesh.normals.push(...n.map((x) => Math.fround(x / length)));
        mesh.uvs.push(snapped(random(), uvSteps), snapped(random(), uvSteps));
    }
    for (let c = 0; c < 3 * triangles; ++c) mesh.indices.push(below(vertices));
    return withLast(mesh);
}

// A hilly field whose image is mirrored in the middle, each vertex used by up to six triangles.
function field(side) {
    const mesh = { positions: [], normals: [], uvs: [], indices: [] };
    for (let y = 0; y <= side; ++y)
        for (let x = 0; x <= side; ++x) {
            const u = x / side, v = y / side;
            mesh.positions.push(Math.fround(u), Math.fround(v), Math.fround(0.1 * Math.sin(9 * u) * Math.cos(7 * v)));
            const slope = [-0.9 * Math.cos(9 * u) * Math.cos(7 * v), 0.7 * Math.sin(9 * u) * Math.sin(7 * v), 1];
            const length = Math.hypot(...slope);
            mesh.normals.push(...slope.map((s) => Math.fround(s / length)));
            mesh.uvs.push(Math.fround(Math.abs(u - 0.5) + (0.1 * random()) / side), Math.fround(v));
        }
    for (let y = 0; y < side; ++y)
        for (let x = 0; x < side; ++x) {
            const a = y * (side + 1) + x;
            mesh.indices.push(a, a + 1, a + side + 2, a, a + side + 2, a + side + 1);
        }
    return withLast(mesh);
}

tell(field(6));
for (const [vertices, triangles, steps, uvSteps] of [
    [12, 20, 0, 0], [30, 40, 0, 0], [20, 40, 4, 0], [20, 40, 0, 3], [24, 50, 4, 3], [10, 40, 2, 2], [60, 60, 64, 5],
]) tell(soup(vertices, triangles, steps, uvSteps));

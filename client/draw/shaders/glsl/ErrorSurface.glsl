// In place of a person's program that is at fault. Loud, the same under any light, on every wall at the same pixels:
// borders of cells are whole squares.

void surface(inout Surface s) {
    vec2 square = floor(gl_FragCoord.xy / 16.0);
    s.base = vec4(mod(square.x + square.y, 2.0) < 0.5 ? vec3(1.0, 0.0, 1.0) : vec3(0.0), 1.0);
    s.emissive = vec3(0.0);
}

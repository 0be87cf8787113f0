// The vertex shader of everything with a mesh: triangles, lines, particles, points.

#ifdef NODE
flat out uvec2 vNode;
#endif
invariant gl_Position;
#ifdef SURFACE
// Where a triangle is seen: at a pixel's middle outside of it normals would turn away, and slivers at a silhouette be
// black. What all of a point has is the same for all its pixels; where on it one looks, its fragments find out.
#ifdef POINTS
#define OVER_SURFACE flat out
flat out vec3 vNormal;
#else
#define OVER_SURFACE out
centroid out vec3 vNormal;
#ifdef TANGENTS
centroid out vec4 vTangent;
#endif
#ifdef POSITION
#ifdef MARCHED
centroid out vec3 vPosition;
#else
out vec3 vPosition;
#endif
#endif
#ifdef LAYERS
out vec3 vItem;  // in the item's own coordinates
#endif
#ifdef PERSON
out vec3 vNodePosition;
#endif
#endif
#ifdef PLAIN
flat out uvec2 vMaterial;
#else
OVER_SURFACE vec4 vColor;
#endif
#ifdef MAPS
OVER_SURFACE vec4 vTexcoords;
flat out vec4 vPlace[10];  // as it is in the block: for a pixel numbers of a block are dear, see kPassedFrame
#endif
#endif

#ifdef STREAKS
#define WIDTH min(texcoord1.y, uintBitsToFloat(itemSize.y))
#else
#define WIDTH uintBitsToFloat(itemSize.x)
#endif
#if defined(LINES) || defined(STREAKS)
// A line is a strip of two triangles as wide as it is to be on the screen, with square ends. `normal` is its other end,
// the second texture coordinate says to which side: of the other end the other way round.
vec4 cornerOfLine(vec4 a) {
    vec4 p = vec4(normal, 1.0);
    vec4 b = clip_T_eye * vec4(dot(eyeRow0, p), dot(eyeRow1, p), dot(eyeRow2, p), 1.0);
    // Up to the near plane, where depth is 1: what lies behind the eye has no place on the screen.
    float beyondA = a.w - a.z, beyondB = b.w - b.z;
    if (beyondA < 0.0 && beyondB < 0.0) return a;
    // Each end by its share: a difference of the two would round the near one away where the other is very far.
    vec4 cut = a * (beyondB / (beyondB - beyondA)) - b * (beyondA / (beyondB - beyondA));
    if (beyondA < 0.0) a = cut;
    if (beyondB < 0.0) b = cut;
    vec2 along = b.xy / (b.w * clipPerPixel.xy) - a.xy / (a.w * clipPerPixel.xy);
    float size = length(along);
    along = size > 1e-6 ? along / size : vec2(1.0 - 2.0 * texcoord1.y, 0.0);
    vec2 aside = texcoord1.x * vec2(-along.y, along.x);
    a.xy += 0.5 * WIDTH * (aside - along) * clipPerPixel.xy * a.w;
#ifndef STREAKS
    // What is an outline lies before its surface; else exactly where it is.
    a.z *= 1.0 + uintBitsToFloat(itemSize.y);
#endif
    return a;
}
#endif

#ifdef SPRITES
// A square in the plane across the way to the head, upright in the world: so it is the same for both eyes and on all
// screens. texcoord1: the cosine and sine of its turn.
vec3 cornerOfSprite(vec3 middle) {
    vec3 towards = head.xyz - middle;
    float far = length(towards);
    towards = far > 1e-12 ? towards / far : vec3(0.0, 0.0, 1.0);
    vec3 aside = cross(worldRow1.xyz, towards);
    float size = length(aside);
    // Seen from right above or below.
    if (size < 1e-4) {
        aside = cross(worldRow2.xyz, towards);
        size = length(aside);
    }
    aside /= size;
    vec3 up = cross(towards, aside);
    vec2 turned = vec2(texcoord1.x * normal.x - texcoord1.y * normal.y,
                       texcoord1.y * normal.x + texcoord1.x * normal.y);
    return middle + 0.5 * texcoord.x * uintBitsToFloat(itemSize.x) * (turned.x * aside + turned.y * up);
}
#endif

#ifdef GLYPHS
// Copies of one mesh (DrawForms.cpp, writeCopies). A vertex's number is the copy's, shifted by GLYPHS bits, and the
// corner's.
vec3 turned(vec4 turn, vec3 v) { return v + 2.0 * cross(turn.xyz, cross(turn.xyz, v) + turn.w * v); }

void fetch() {
    int copy = 3 * (gl_VertexID >> GLYPHS);
    uvec4 place = texelFetch(fetched, copy), scale = texelFetch(fetched, copy + 2);
    vec4 turn = uintBitsToFloat(texelFetch(fetched, copy + 1));
    int corner = copy - int(scale.z) + 2 * (gl_VertexID & ((1 << GLYPHS) - 1));
    vec2 widthAndLength = uintBitsToFloat(scale.xy);
    uvec4 point = texelFetch(fetched, corner);
    position = uintBitsToFloat(place.xyz) + turned(turn, widthAndLength.xyx * uintBitsToFloat(point.xyz));
#ifdef SURFACE
    // Of a length across a normal is divided by it: here by their product, times the other one.
    uvec4 aside = texelFetch(fetched, corner + 1);
    normal = turned(turn, widthAndLength.yxy * uintBitsToFloat(aside.xyz));
    texcoord = uintBitsToFloat(uvec2(point.w, aside.w));
    color = linearColor(place.w);
#endif
}
#endif

void main() {
#ifdef FETCHED
    fetch();
#endif
#ifdef MOVED
    // A person's program: no farther than it says, as boxes know that alone.
    uv = texcoord;
    uv1 = texcoord1;
    vec3 movedPosition = position, movedNormal = normal;
    vertex(movedPosition, movedNormal);
    vec3 moved = movedPosition - position;
    float way = length(moved);
    // Of what is no number nothing is moved.
    movedPosition = position + (way <= tesseraReach ? moved : way < 1e30 ? moved * (tesseraReach / way) : vec3(0.0));
    movedNormal = dot(movedNormal, movedNormal) < 1e30 ? movedNormal : normal;
#define position movedPosition
#define normal movedNormal
#endif
    vec4 p = vec4(position, 1.0);
    vec3 eye = vec3(dot(eyeRow0, p), dot(eyeRow1, p), dot(eyeRow2, p));
#ifdef DISCS
    eye.xy += 0.5 * texcoord.x * uintBitsToFloat(itemSize.x) * normal.xy;
#endif
#ifdef SPRITES
    eye = cornerOfSprite(eye);
#endif
#ifdef POINTS
    gl_Position = aroundBall(eye);
#else
    gl_Position = clip_T_eye * vec4(eye, 1.0);
#endif
#if defined(LINES) || defined(STREAKS)
    gl_Position = cornerOfLine(gl_Position);
#endif
#ifdef ROWS
    vRow0 = normalRow0.xyz;
    vRow1 = normalRow1.xyz;
    vRow2 = normalRow2.xyz;
#endif
#ifdef NODE
    vNode = node;
#endif
#ifdef SURFACE
#if defined(DISCS) || defined(SPRITES)
    vNormal = vec3(0.0, 0.0, 1.0);
#else
    vNormal = vec3(dot(normalRow0.xyz, normal), dot(normalRow1.xyz, normal), dot(normalRow2.xyz, normal));
#endif
#ifdef TANGENTS
    // Both of length 1 at a vertex, and as they come in between: as normal maps are baked (Mikkelsen 2008). In a mirror
    // normals stay on their side, and what is across both points the other way.
    vec3 along = vec3(dot(eyeRow0.xyz, tangent.xyz), dot(eyeRow1.xyz, tangent.xyz), dot(eyeRow2.xyz, tangent.xyz));
    float normal2 = dot(vNormal, vNormal), along2 = dot(along, along);
    vNormal *= normal2 > 1e-36 ? inversesqrt(normal2) : 0.0;
    along *= along2 > 1e-36 ? inversesqrt(along2) : 0.0;
    float mirrored = dot(cross(eyeRow0.xyz, eyeRow1.xyz), eyeRow2.xyz) < 0.0 ? -1.0 : 1.0;
    vTangent = vec4(along, mirrored * tangent.w);
#endif
#ifdef PLAIN
    vMaterial = look.material.yz;
#if defined(POINTS) && (POINTS & POINT_COLORS) != 0
    // All of a point is of one colour.
    uvec3 c = uvec3(sqrt(clamp(look.baseColor.rgb * color.rgb, 0.0, 1.0)) * 255.0 + 0.5);
    vMaterial.y = (vMaterial.y & 0xff000000u) | c.r | (c.g << 8u) | (c.b << 16u);
#endif
#if defined(POINTS) && (POINTS & POINT_NORMALS) != 0
    vMaterial.x |= packedNormal(vNormal);
#endif
#else
    vColor = look.baseColor * color;
#endif
#ifdef POINTS
#ifdef IN_ITEM
    vPoint = vec4(position, uintBitsToFloat((POINTS & POINT_STRETCHED) != 0 ? itemSize.x : itemSize.y));
#endif
#else
#ifdef POSITION
    vPosition = eye;
#endif
#ifdef LAYERS
    vItem = position;
#endif
#ifdef PERSON
    vNodePosition = position;
#endif
#endif
#ifdef MAPS
    vPlace = look.place;
#if defined(DISCS) || defined(SPRITES)
    vTexcoords = 0.5 + 0.5 * vec4(normal.x, -normal.y, normal.x, -normal.y);
#elif defined(STREAKS)
    vTexcoords = vec4(0.5);
#elif defined(LINES)
    vTexcoords = texcoord.xyxy;
#else
    vTexcoords = vec4(texcoord, texcoord1);
#endif
#endif
#endif
}

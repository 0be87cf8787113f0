/// The shaders, in pieces that programs are put together from: kNAME is glsl/NAME.glsl, as ShaderText.cmake embeds it.
/// Each begins with a line break.
#pragma once

namespace tessera::shader_text {

/// Uniform blocks: what a frame and what a material is.
extern const char kBlocks[];
/// What comes with a vertex and of its item: what the vertex shader of everything with a mesh begins with. LARGE: where
/// it has its item from; FETCHED: a function `void fetch()` finds the vertex by its number.
extern const char kItemInputs[];
/// That shader. One text for all programs and all tiles, its position invariant:
/// coordinates, and so seams, are the same in each of them. TRIANGLES, POINTS, LINES: what it makes them of; SURFACE,
/// POSITION, MAPS, NODE say what it passes on.
extern const char kMeshVertex[];
/// Between the two, of points: what makes the triangles around them. BLENDED, and see kPointFragment.
extern const char kPointVertex[];
/// Before all else of a fragment shader that draws points: `void meetBall()`, which leaves away what is beside the
/// ball, and says depth, and what `surface()` asks for. SAMPLES; SHADOW; IN_ITEM: where on it in the item, too; ROWS:
/// needs the normals' rows.
extern const char kPointFragment[];
/// `Surface`: what is said of a pixel.
extern const char kSurfaceStruct[];
/// What a material and its images say of a pixel: `Surface surface()`, for all that follow. MAPS (bits of MAP_…: which
/// images), POSITION, FACETED; PERSON: then what a person's `void surface(inout Surface)` makes of it.
extern const char kSurface[];
/// A normal in the bits that the first pass has for it.
extern const char kPackNormal[];
/// First pass of what is solid: material, colour and normal of each sample, packed into 64 bits; DETAIL: and into 64
/// more what images say besides. MASKED: by alpha. SAMPLES.
extern const char kPackFragment[];
/// Light: environment and lights. LIGHTS: where these are looked for (LIGHTS_…); SUNS_ALONE: all are suns, and the
/// frame says them. COATED: lacquer.
extern const char kLighting[];
/// The curves that are to be had of brighter light (ToneCurves.h), each a function.
extern const char kToneCurves[];
/// From radiance to what a screen shows, after kToneCurves. TONE_CURVE: which.
extern const char kToneMapping[];
/// A triangle around the whole screen, at SCREEN_DEPTH; with FRAME_PASSED_ON it hands the frame's block on.
extern const char kScreenVertex[];
/// The frame's block as that comes from it, before both stages: PASSED is `flat out`, `flat in`.
extern const char kPassedFrame[];
/// What the first pass has packed. SAMPLES, DETAIL.
extern const char kReadSurface[];
/// What the first pass begins with. DETAIL.
extern const char kClearFragment[];
/// Second pass, after kReadSurface, of several samples: what is to be done in a pixel, as its depth. DETAIL.
extern const char kClassifyFragment[];
/// After kLighting, kToneMapping, kReadSurface: light on what the samples of a pixel show. SAMPLES; ONE_SURFACE where
/// they all show the same; REST for the surfaces of a pixel beside its first; METER: instead how bright one pixel of a
/// square is, without kToneMapping.
extern const char kLightFragment[];
/// What is transparent: surface and light in one.
extern const char kBlendFragment[];
/// The same of scalar fields, after kLighting, kToneMapping. MARCHED: how; SLICES.
extern const char kVolumeFragment[];
/// A picture into every sample; then the second colours of pixels into the samples that show them. Alpha 0.
extern const char kCopyFragment[];
extern const char kSpreadFragment[];
/// The mean of the samples, where something was blended over any of them: where alpha is no longer 0.
extern const char kResolveFragment[];
/// MASKED: after kSurface.
extern const char kNodeIdFragment[];
/// The same without any colour.
extern const char kShadowFragment[];
/// Nothing but depth, which cullers ask for.
extern const char kDepthFragment[];
/// Corners in clip space.
extern const char kPlateVertex[];
/// The farthest depth of each pixel's samples. SAMPLES.
extern const char kFarthestFragment[];
/// `surface()` in place of a person's program that is at fault.
extern const char kErrorSurface[];

}  // namespace tessera::shader_text

/// The OpenGL 4.5 functions that drawing uses, as a table filled from one surface. No libGL is linked: OSMesa and libGL
/// both export the gl* names, and only one of them may be in a process.
#pragma once

#include <GL/glcorearb.h>

#include "client/draw/surface/Surface.h"

namespace tessera {

/// X(name without "gl", name in capitals as in PFNGL…PROC).
#define TESSERA_GL_FUNCTIONS(X)                                                                 \
    X(AttachShader, ATTACHSHADER)                                                               \
    X(BeginQuery, BEGINQUERY)                                                                   \
    X(CheckNamedFramebufferStatus, CHECKNAMEDFRAMEBUFFERSTATUS)                                 \
    X(ClearNamedFramebufferfv, CLEARNAMEDFRAMEBUFFERFV)                                         \
    X(ClearNamedFramebufferuiv, CLEARNAMEDFRAMEBUFFERUIV)                                       \
    X(CompileShader, COMPILESHADER)                                                             \
    X(CompressedTextureSubImage2D, COMPRESSEDTEXTURESUBIMAGE2D)                                 \
    X(CompressedTextureSubImage3D, COMPRESSEDTEXTURESUBIMAGE3D)                                 \
    X(CopyImageSubData, COPYIMAGESUBDATA)                                                       \
    X(CopyNamedBufferSubData, COPYNAMEDBUFFERSUBDATA)                                           \
    X(CreateBuffers, CREATEBUFFERS)                                                             \
    X(CreateFramebuffers, CREATEFRAMEBUFFERS)                                                   \
    X(CreateProgram, CREATEPROGRAM)                                                             \
    X(CreateQueries, CREATEQUERIES)                                                             \
    X(CreateRenderbuffers, CREATERENDERBUFFERS)                                                 \
    X(CreateSamplers, CREATESAMPLERS)                                                           \
    X(CreateShader, CREATESHADER)                                                               \
    X(CreateTextures, CREATETEXTURES)                                                           \
    X(CreateVertexArrays, CREATEVERTEXARRAYS)                                                   \
    X(DeleteBuffers, DELETEBUFFERS)                                                             \
    X(DeleteFramebuffers, DELETEFRAMEBUFFERS)                                                   \
    X(DeleteProgram, DELETEPROGRAM)                                                             \
    X(DeleteQueries, DELETEQUERIES)                                                             \
    X(DeleteRenderbuffers, DELETERENDERBUFFERS)                                                 \
    X(DeleteSamplers, DELETESAMPLERS)                                                           \
    X(DeleteShader, DELETESHADER)                                                               \
    X(DeleteTextures, DELETETEXTURES)                                                           \
    X(DeleteVertexArrays, DELETEVERTEXARRAYS)                                                   \
    X(DrawArrays, DRAWARRAYS)                                                                   \
    X(DrawElementsInstancedBaseVertexBaseInstance, DRAWELEMENTSINSTANCEDBASEVERTEXBASEINSTANCE) \
    X(EnableVertexArrayAttrib, ENABLEVERTEXARRAYATTRIB)                                         \
    X(EndQuery, ENDQUERY)                                                                       \
    X(Finish, FINISH)                                                                           \
    X(GenerateTextureMipmap, GENERATETEXTUREMIPMAP)                                             \
    X(GetError, GETERROR)                                                                       \
    X(GetGraphicsResetStatus, GETGRAPHICSRESETSTATUS)                                           \
    X(GetIntegerv, GETINTEGERV)                                                                 \
    X(GetProgramInfoLog, GETPROGRAMINFOLOG)                                                     \
    X(GetProgramiv, GETPROGRAMIV)                                                               \
    X(GetQueryObjectuiv, GETQUERYOBJECTUIV)                                                     \
    X(GetShaderInfoLog, GETSHADERINFOLOG)                                                       \
    X(GetShaderiv, GETSHADERIV)                                                                 \
    X(GetStringi, GETSTRINGI)                                                                   \
    X(GetTextureImage, GETTEXTUREIMAGE)                                                         \
    X(GetUniformLocation, GETUNIFORMLOCATION)                                                   \
    X(LinkProgram, LINKPROGRAM)                                                                 \
    X(NamedBufferSubData, NAMEDBUFFERSUBDATA)                                                   \
    X(MapNamedBufferRange, MAPNAMEDBUFFERRANGE)                                                 \
    X(NamedBufferStorage, NAMEDBUFFERSTORAGE)                                                   \
    X(NamedFramebufferRenderbuffer, NAMEDFRAMEBUFFERRENDERBUFFER)                               \
    X(MultiDrawElementsBaseVertex, MULTIDRAWELEMENTSBASEVERTEX)                                 \
    X(NamedFramebufferDrawBuffers, NAMEDFRAMEBUFFERDRAWBUFFERS)                                 \
    X(NamedFramebufferTexture, NAMEDFRAMEBUFFERTEXTURE)                                         \
    X(NamedFramebufferTextureLayer, NAMEDFRAMEBUFFERTEXTURELAYER)                               \
    X(NamedRenderbufferStorageMultisample, NAMEDRENDERBUFFERSTORAGEMULTISAMPLE)                 \
    X(ReadPixels, READPIXELS)                                                                   \
    X(SamplerParameterf, SAMPLERPARAMETERF)                                                     \
    X(SamplerParameteri, SAMPLERPARAMETERI)                                                     \
    X(ShaderSource, SHADERSOURCE)                                                               \
    X(TextureBuffer, TEXTUREBUFFER)                                                             \
    X(TextureParameteri, TEXTUREPARAMETERI)                                                     \
    X(TextureStorage2D, TEXTURESTORAGE2D)                                                       \
    X(TextureStorage2DMultisample, TEXTURESTORAGE2DMULTISAMPLE)                                 \
    X(TextureStorage3D, TEXTURESTORAGE3D)                                                       \
    X(TextureSubImage2D, TEXTURESUBIMAGE2D)                                                     \
    X(TextureSubImage3D, TEXTURESUBIMAGE3D)                                                     \
    X(Uniform1fv, UNIFORM1FV)                                                                   \
    X(Uniform2fv, UNIFORM2FV)                                                                   \
    X(Uniform3fv, UNIFORM3FV)                                                                   \
    X(Uniform4fv, UNIFORM4FV)                                                                   \
    X(VertexArrayAttribBinding, VERTEXARRAYATTRIBBINDING)                                       \
    X(VertexArrayAttribFormat, VERTEXARRAYATTRIBFORMAT)                                         \
    X(VertexArrayAttribIFormat, VERTEXARRAYATTRIBIFORMAT)                                       \
    X(VertexArrayBindingDivisor, VERTEXARRAYBINDINGDIVISOR)                                     \
    X(VertexArrayElementBuffer, VERTEXARRAYELEMENTBUFFER)                                       \
    X(VertexArrayVertexBuffer, VERTEXARRAYVERTEXBUFFER)

/// Those that set what outlives them: GlState's alone.
#define TESSERA_GL_STATE_FUNCTIONS(X)       \
    X(BindBufferBase, BINDBUFFERBASE)       \
    X(BindBufferRange, BINDBUFFERRANGE)     \
    X(BindFramebuffer, BINDFRAMEBUFFER)     \
    X(BindSampler, BINDSAMPLER)             \
    X(BindTextureUnit, BINDTEXTUREUNIT)     \
    X(BindVertexArray, BINDVERTEXARRAY)     \
    X(BlendFuncSeparate, BLENDFUNCSEPARATE) \
    X(ClipControl, CLIPCONTROL)             \
    X(ColorMask, COLORMASK)                 \
    X(DepthFunc, DEPTHFUNC)                 \
    X(DepthMask, DEPTHMASK)                 \
    X(Disable, DISABLE)                     \
    X(Enable, ENABLE)                       \
    X(FrontFace, FRONTFACE)                 \
    X(NamedBufferData, NAMEDBUFFERDATA)     \
    X(PixelStorei, PIXELSTOREI)             \
    X(Scissor, SCISSOR)                     \
    X(UseProgram, USEPROGRAM)               \
    X(Viewport, VIEWPORT)

/// `gl.Clear(…)` for glClear(…). Valid for the surface it was loaded from, on its thread.
struct GlFunctions {
#define TESSERA_GL_MEMBER(name, upper) PFNGL##upper##PROC name = nullptr;
    TESSERA_GL_FUNCTIONS(TESSERA_GL_MEMBER)

    /// The surface must be current. kUnsupported: it gives less than OpenGL 4.5, and says what it gives.
    [[nodiscard]] static Expected<GlFunctions> load(const Surface& surface);

    /// The first error since the last call, in words. GL reports late: `what` is what was being done. kUnsupported: the
    /// GPU is gone.
    [[nodiscard]] Expected<void> check(std::string_view what) const;
    [[nodiscard]] bool hasExtension(std::string_view name) const;

protected:
    TESSERA_GL_STATE_FUNCTIONS(TESSERA_GL_MEMBER)
#undef TESSERA_GL_MEMBER
};

}  // namespace tessera

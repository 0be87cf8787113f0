// Programs, made when first needed; and ahead of need those that the same things would need in other light.
#include <algorithm>

#include "client/draw/RendererImpl.h"

namespace tessera {

Expected<GLuint> Renderer::Impl::program(const ProgramKind& kind) {
    auto it = programs.find(kind);
    if (it == programs.end()) {
        auto made = Program::create(gl, kind);
        if (!made) return tl::unexpected(made.error());
        it = programs.emplace(kind, std::move(*made)).first;
    }
    return it->second.name();
}

Expected<void> Renderer::Impl::useProgram(const ProgramKind& kind) {
    const auto name = program(kind);
    if (!name) return tl::unexpected(name.error());
    gl.UseProgram(*name);
    meshes->bindFor(kind.items);
    return {};
}

void Renderer::Impl::expect(Pass pass, const ProgramKind& kind, std::uint32_t look) {
    const Drawn what(pass, kind);
    const bool known =
        drawnWith.contains(what) || std::any_of(kin.begin(), kin.end(), [&](const Kin& k) { return k.what == what; });
    if (!known) kin.push_back({what, look});
}

void Renderer::Impl::met(Pass pass, const ProgramKind& kind, std::uint32_t look) {
    const bool isNew = drawnWith.insert({pass, kind}).second;
    // With images it may have been forgotten, see `collect`.
    if (isNew || kind.maps != 0 || kind.layers != 0) expectKin(pass, kind, look);
}

void Renderer::Impl::expectKin(Pass pass, const ProgramKind& kind, std::uint32_t look) {
    if (pass == Pass::kSurfaces && rowOf(kind.items).castsShadows) expect(Pass::kShadow, shadowOf(kind), look);
    if (!isLit(kind.use)) return;
    for (const bool environment : {kind.environment, !kind.environment})
        for (const LightLists lists : kAllLightLists) {
            expect(pass, otherwiseLit(kind, lists, environment, false), look);
            // Suns alone have no scopes (LightBuffers.cpp).
            if (lists != LightLists::kSun && lists != LightLists::kSuns) expect(pass, otherwiseLit(kind, lists, environment, true), look);
        }
}

/// A software rasteriser compiles when it first draws with a state: here into an empty rectangle.
Expected<void> Renderer::Impl::make(Pass pass, const ProgramKind& kind, std::uint32_t look) {
    if (auto entered = enter(pass); !entered) return entered;
    gl.Scissor(0, 0, 0, 0);
    if (auto used = useProgram(kind); !used) return used;
    if (look < calls.looks().size()) bindLook(look, kind.maps, kind.layers);
    gl.BindVertexArray(pass == Pass::kBlend || pass == Pass::kShadow ? vertexArray : emptyArray);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    return {};
}

bool Renderer::prepare() {
    Impl& d = *impl_;
    if (d.kin.empty() || !d.surface.makeCurrent()) return false;
    const Impl::Kin next = d.kin.front();
    d.kin.erase(d.kin.begin());
    // What cannot be made is an error where it is needed.
    static_cast<void>(d.make(next.what.first, next.what.second, next.look));
    static_cast<void>(d.gl.check("making a program ahead of need"));
    d.drawnWith.insert(next.what);
    return true;
}

}  // namespace tessera

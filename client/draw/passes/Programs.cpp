// Programs, made when first needed; and ahead of need those that the same things would need in other light.
#include <algorithm>
#include <utility>

#include "client/draw/passes/RendererImpl.h"

namespace tessera {

Expected<GLuint> Renderer::Impl::program(const ProgramKind& kind) {
    auto it = programs.find(kind);
    if (it == programs.end()) {
        if (auto wanted = goOn(); !wanted) return tl::unexpected(wanted.error());
        auto made = Program::create(gl, kind, kind.person ? &looks.persons().textOf(kind.person) : nullptr);
        if (!made && kind.person > PersonPrograms::kError) {
            // Other drivers know other errors than the server's.
            looks.persons().refused(kind.person, made.error().message);
            shadows.forget();  // they may show what it made of things
            ProgramKind instead = kind;
            instead.person = PersonPrograms::kError;
            return program(instead);
        }
        if (!made) return tl::unexpected(made.error());
        ++compiled;
        it = programs.emplace(kind, std::move(*made)).first;
    }
    return it->second.name();
}

Expected<void> Renderer::Impl::useProgram(const ProgramKind& kind) {
    const auto name = program(kind);
    if (!name) return tl::unexpected(name.error());
    gl.UseProgram(*name);
    if (kind.person > PersonPrograms::kError && looks.persons().textOf(kind.person).loops) loops.bind();
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
    const bool isNew = !std::exchange(drawnWith[{pass, kind}], true);
    // With images, or a person's program, it may have been forgotten, see `collect`.
    if (isNew || kind.maps != 0 || kind.layers != 0 || kind.person != 0) expectKin(pass, kind, look);
}

void Renderer::Impl::expectKin(Pass pass, const ProgramKind& kind, std::uint32_t look) {
    if (pass == Pass::kSurfaces && rowOf(kind.items).castsShadows) expect(Pass::kShadow, shadowOf(kind), look);
    if (!isLit(kind.use)) return;
    if (kind.studio) {  // without shadows, where detail is left away
        ProgramKind shadowless = kind;
        shadowless.lists = LightLists::kSuns;
        expect(pass, shadowless, look);
    }
    // What is one change away: other surroundings, or other lights. What lies beyond follows once that is drawn.
    // A studio goes where there are surroundings, and two suns stand in for its lamps.
    ProgramKind elsewhere = kind.studio ? otherwiseLit(kind, LightLists::kSuns, false, false) : kind;
    elsewhere.environment = !kind.environment;
    expect(pass, elsewhere, look);
    for (const LightLists lists : kAllLightLists) {
        const ProgramKind plain = otherwiseLit(kind, lists, kind.environment, false);
        expect(pass, plain, look);
        if (lists == LightLists::kShadows) {
            ProgramKind cubes = plain, oneSun = plain;
            cubes.cubes = true;
            expect(pass, cubes, look);
            oneSun.oneSun = true;
            if (kind.use != ProgramKind::Use::kBlend) expect(pass, oneSun, look);
        }
        // Those that FrameBlock says have no scopes (LightBuffers.cpp).
        if (lists != LightLists::kSun && lists != LightLists::kSuns && lists != LightLists::kFew)
            expect(pass, otherwiseLit(kind, lists, kind.environment, true), look);
    }
}

void Renderer::Impl::say(const ProgramKind& kind, const DrawLook& look) {
    const auto made = kind.person > PersonPrograms::kError ? programs.find(kind) : programs.end();
    if (made == programs.end()) return;
    const std::vector<PersonUniform>& uniforms = looks.persons().textOf(kind.person).uniforms;
    const std::vector<GLint>& places = made->second.locations();
    gl.Uniform1fv(places.back(), 1, &look.said.reach);
    for (std::size_t i = 0; i < look.said.numbers.size(); ++i) {
        const float* value = look.said.numbers[i].data();
        switch (uniforms[i].width) {
            case 1:
                gl.Uniform1fv(places[i], 1, value);
                break;
            case 2:
                gl.Uniform2fv(places[i], 1, value);
                break;
            case 3:
                gl.Uniform3fv(places[i], 1, value);
                break;
            default:
                gl.Uniform4fv(places[i], 1, value);
        }
    }
    for (std::size_t i = 0; i < look.said.maps.size(); ++i) {
        const PersonValues::Map& map = look.said.maps[i];
        const auto unit = static_cast<GLuint>(kPersonUnit + i);
        gl.BindTextureUnit(unit, map.texture ? map.texture->name : white);
        gl.BindSampler(unit, textures.sampler(map.sampler));
    }
}

namespace {

Duration sumOf(const std::map<std::uint32_t, Duration>& times) {
    Duration sum{};
    for (const auto& [person, took] : times) sum += took;
    return sum;
}

}  // namespace

bool Renderer::Impl::isWatched(const ProgramKind& kind) const {
    return kind.person > PersonPrograms::kError && options.programsMost.count() > 0 &&
           looks.persons().textOf(kind.person).loops;
}

Expected<void> Renderer::Impl::compileWatched(ProgramKind::Use use) {
    std::vector<ProgramKind> compiledNow;
    const std::uint64_t statesBefore = states;
    for (const std::uint32_t index : inPass) {
        const DrawCall& call = calls.calls()[index];
        // Nearly all are nobody's.
        if (!looks[call.look].person) continue;
        const ProgramKind kind = kindOf(use, call);
        if (!isWatched(kind) || std::ranges::find(compiledNow, kind) != compiledNow.end()) continue;
        compiledNow.push_back(kind);
        gl.Scissor(0, 0, 0, 0);
        if (auto set = setState(call, nullptr, kind); !set) return set;
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    }
    if (compiledNow.empty()) return {};
    states = statesBefore;
    gl.Scissor(scissor.x, scissor.y, scissor.width, scissor.height);
    if (use == ProgramKind::Use::kBlend) gl.DepthFunc(GL_GREATER);
    return {};
}

Expected<void> Renderer::Impl::watchFor(const ProgramKind& kind) {
    const bool dear = isWatched(kind);
    const bool known = std::ranges::find(watched, kind.person) != watched.end();
    if (!watched.empty() && (known || (!watchesEach && !dear))) return {};
    if (watchesEach)
        if (auto ended = watchNoMore(); !ended) return ended;
    if (!dear) return {};
    if (watched.empty()) {
        gl.Finish();
        loops.begin(loopsMay - std::min(sumOf(loopsTook), loopsMay));
    }
    watched.push_back(kind.person);
    return {};
}

Expected<void> Renderer::Impl::watchNoMore() {
    if (watched.empty()) return {};
    gl.Finish();
    const Duration took = loops.end();
    shared = shared || watched.size() > 1;
    for (const std::uint32_t program : watched) loopsTook[program] += took / watched.size();
    if (loops.stopped()) return fail(ErrorCode::kRefused, "a program of a material takes too long");
    watched.clear();
    return {};
}

/// The one that was drawn with when time was over; of several the dearest, once that is known.
void Renderer::Impl::blame() {
    shadows.forget();  // they show what the program made of things
    if (!watchesEach && (shared || watched.size() > 1)) {
        watchesEach = true;
        shared = false;
        loopsTookBefore.clear();  // shares, and not what each of them took
        return;
    }
    for (auto& [person, took] : loopsTook)
        if (const auto before = loopsTookBefore.find(person); before != loopsTookBefore.end()) took += before->second;
    const auto dearest = std::ranges::max_element(loopsTook, {}, [](const auto& entry) { return entry.second; });
    looks.persons().holdsUp(dearest->first, dearest->second);
    loopsTookBefore.erase(dearest->first);
}

/// Where many are dear: to name one after the other would take longer than the others wait for this host.
void Renderer::Impl::blameAll() {
    shadows.forget();
    for (const DrawCall& call : calls.calls())
        if (const std::uint32_t person = looks[call.look].person;
            person > PersonPrograms::kError && looks.persons().textOf(person).loops)
            looks.persons().holdsUp(person, options.programsMost);
}

Expected<void> Renderer::Impl::drawInTime(const std::function<Expected<void>()>& once) {
    constexpr int kMostTries = 4;
    if (!framesAreTold) loopsTookBefore.clear();
    loopsMay = options.programsMost - std::min<Duration>(sumOf(loopsTookBefore), options.programsMost);
    for (int tries = 1;; ++tries) {
        watched.clear();
        loopsTook.clear();
        const Expected<void> drawn = once();
        // What ended in between with another error.
        if (!watched.empty() && !loops.stopped()) static_cast<void>(watchNoMore());
        if (!loops.stopped()) {
            for (const auto& [person, took] : loopsTook) loopsTookBefore[person] += took;
            return drawn;
        }
        static_cast<void>(gl.check("what was ended"));
        blame();
        if (tries >= kMostTries) blameAll();
        loops.letGo();
        // Less would condemn who took its time, and not too much of it.
        loopsMay = options.programsMost;
    }
}

/// A software rasteriser compiles when it first draws with a state: here into an empty rectangle.
Expected<void> Renderer::Impl::make(Pass pass, const ProgramKind& kind, std::uint32_t look) {
    scissor = {};
    setUp({.x = 0, .y = 0, .width = kCellWidthPx, .height = kCellHeightPx}, 0);
    if (auto entered = enter(pass); !entered) return entered;
    if (auto used = useProgram(kind); !used) return used;
    if (looks.has(look)) bindLook(look, kind.maps, kind.layers);
    if (looks.has(look) && kind.person == looks[look].person) say(kind, looks[look]);
    gl.BindVertexArray(pass == Pass::kBlend || pass == Pass::kShadow ? vertexArray : emptyArray);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    return {};
}

bool Renderer::mayPrepare() const {
    return !impl_->kin.empty();
}

bool Renderer::prepare() {
    Impl& d = *impl_;
    if (d.kin.empty() || !d.surface.makeCurrent()) return false;
    const GlState::Call call(d.gl);
    // Clients of one machine share the driver's cache on disk: each begins somewhere else, so that they do not all
    // compile the same at the same time.
    const auto one = d.kin.begin() + static_cast<std::ptrdiff_t>(d.anyKin() % d.kin.size());
    const Impl::Kin next = *one;
    d.kin.erase(one);
    // What cannot be made is an error where it is needed.
    static_cast<void>(d.make(next.what.first, next.what.second, next.look));
    static_cast<void>(d.gl.check("making a program ahead of need"));
    d.drawnWith.try_emplace(next.what, false);
    return true;
}

}  // namespace tessera

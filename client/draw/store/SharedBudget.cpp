#include "client/draw/store/SharedBudget.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace tessera {
namespace {

constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

std::size_t less(std::size_t bytes, std::size_t taken) {
    return bytes - std::min(bytes, taken);
}

/// What these take beyond `bytes` goes: what nobody draws, or, `all`, what is not needed now. `unused`: what else they
/// have of GL, which follows when others go.
template <typename... Stores>
void shed(bool all, std::size_t bytes, std::size_t unused, Stores&... stores) {
    const auto held = [&] { return (stores.residentBytes() + ...); };
    if (held() + unused <= bytes) return;
    std::vector<UseClock::Spare> spares;
    (stores.addSpares(spares), ...);
    if (!all) std::erase_if(spares, [](const UseClock::Spare& spare) { return !UseClock::isIdle(spare.nextUse); });
    UseClock::giveWay(spares, bytes, held);
}

}  // namespace

void SharedBudget::set(const Limit& limit) {
    limit_ = limit;
    divide();
}

std::size_t SharedBudget::room() const {
    return std::max(limit_.bytes / 4, less(limit_.bytes, limit_.others));
}

void SharedBudget::divide() {
    const std::size_t room = this->room();
    const std::size_t meshes = meshes_.allocatedBytes(), textures = textures_.residentBytes(),
                      volumes = volumes_.residentBytes();
    const auto either = [](std::size_t own, std::size_t rest) { return own > 0 ? own : rest; };
    const std::size_t atOnce = less(limit_.there, limit_.others + textures + volumes);
    meshes_.setBudget({.bytes = either(own_.meshes, less(room, textures + volumes)),
                       .atOnce = atOnce,
                       .mostAtOnce = limit_.hard ? atOnce : kNoLimit});
    textures_.setBudget(either(own_.textures, less(room, meshes + volumes)));
    volumes_.setBudget(either(own_.textures, less(room, meshes + textures)));
}

void SharedBudget::shedToLimits(bool all) {
    if (own_.meshes > 0) shed(all, own_.meshes, 0, meshes_);
    if (own_.textures > 0) {
        shed(all, own_.textures, 0, textures_);
        shed(all, own_.textures, 0, volumes_);
    }
    shed(all, room(), meshes_.allocatedBytes() - meshes_.residentBytes(), meshes_, textures_, volumes_);
    divide();
}

void SharedBudget::beginDraw() {
    clock_.beginDraw();
    shedToLimits(true);
    meshes_.beginDraw();
}

void SharedBudget::rest() {
    shedToLimits(false);
    meshes_.rest();
}

void SharedBudget::beginDepths() {
    clock_.beginDraw();
    divide();
    meshes_.beginDraw();
}

}  // namespace tessera

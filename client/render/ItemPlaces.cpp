#include "client/render/ItemPlaces.h"

#include "common/base/Error.h"

namespace tessera {
namespace places::plain {
extern const PlaceKernels kKernels;
}
namespace places::avx2 {
extern const PlaceKernels kKernels;
}

std::span<const places::PlaceKernels* const> placeKernelsHere() {
    static constexpr const places::PlaceKernels* kAll[] = {&places::plain::kKernels, &places::avx2::kKernels};
    static const std::span<const places::PlaceKernels* const> here =
        std::span(kAll).first(__builtin_cpu_supports("avx2") ? 2 : 1);
    return here;
}

void placeBeforeEye(const Affine3d& eye_T_world, std::span<const places::Matrix> world_T_items,
                    std::span<float* const> rows) {
    TESSERA_CHECK(rows.size() == world_T_items.size(), "rows for each item");
    placeKernelsHere().back()->beforeEye(eye_T_world.data(), world_T_items.data(), rows.data(), rows.size());
}

void placeOnScreen(const TileProjection& screen, std::span<const double* const> boxes,
                   std::span<const places::Matrix> world_T_items, std::span<places::Rectangle> found) {
    TESSERA_CHECK(boxes.size() == found.size() && world_T_items.size() == found.size(), "a box for each item");
    placeKernelsHere().back()->onScreen(screen.screen(), boxes.data(), world_T_items.data(), found.data(),
                                        found.size());
}

}  // namespace tessera

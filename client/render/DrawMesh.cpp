#include "client/render/DrawMesh.h"

#include <atomic>

namespace tessera {

std::uint64_t nextSerial() {
    static std::atomic<std::uint64_t> last{0};
    return ++last;
}

std::shared_ptr<const DrawMesh> drawMeshOf(const Drawable& drawable) {
    if (!drawable || !drawable.resident()) return nullptr;
    MeshArrays arrays = drawable.arrays();
    return std::make_shared<const DrawMesh>(DrawMesh{.serial = nextSerial(),
                                                     .key = keyOf(arrays),
                                                     .arrays = arrays,
                                                     .sound = checkMesh(arrays).has_value(),
                                                     .clusters = {}});
}

}  // namespace tessera

#include "client/render/scene/SceneContents.h"

#include <algorithm>
#include <tuple>
#include <unordered_map>

#include "client/render/scene/SceneItems.h"

namespace tessera {

std::vector<SceneContent> contentsOf(const RenderScene& scene, const Vec3d& eyeWorld) {
    struct Near {
        double distance2;
        SceneContent content;
    };
    std::unordered_map<ObjectId, Near> nearest;
    const RenderScene::Impl& all = scene.impl();
    for (std::size_t i = 0; i < all.items.size(); ++i) {
        const Box& box = all.boxes[i];
        if (box.empty()) continue;
        const Vec3d inside = eyeWorld.cwiseMax(box.lower).cwiseMin(box.upper);
        const Near here{(inside - eyeWorld).squaredNorm(),
                        {all.items[i].geometry, all.items[i].material, all.items[i].mesh->drawn}};
        const auto [known, isNew] = nearest.try_emplace(here.content.geometry, here);
        known->second.distance2 = std::min(known->second.distance2, here.distance2);
    }
    std::vector<Near> order;
    order.reserve(nearest.size());
    for (const auto& [geometry, near] : nearest) order.push_back(near);
    std::sort(order.begin(), order.end(), [](const Near& a, const Near& b) {
        return std::tie(a.distance2, a.content.geometry) < std::tie(b.distance2, b.content.geometry);
    });
    std::vector<SceneContent> contents;
    contents.reserve(order.size());
    for (const Near& near : order) contents.push_back(near.content);
    return contents;
}

}  // namespace tessera

// The scenes that come with Tessera load without a remark and hold the bodies that they promise.

#include "common/cores/CollisionObject.h"
#include "common/cores/Interest.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

struct Shipped {
    const char* file;
    std::size_t freeBodies;  ///< collision objects with a mass
    std::size_t interests;
};
void PrintTo(const Shipped& scene, std::ostream* out) {
    *out << scene.file;
}

class ShippedScene : public testing::TestWithParam<Shipped> {};

TEST_P(ShippedScene, LoadsWithoutARemarkAndHoldsItsBodies) {
    ImportOptions options = importOptions();
    const std::string file = GetParam().file, data = testData();
    if (file.find("engine") != std::string::npos && !std::filesystem::exists(kEngine))
        GTEST_SKIP() << kEngine << " is missing (Debian package assimp-testmodels)";
    if (file.find("pour") != std::string::npos || file.find("plant") != std::string::npos) {
        if (data.empty()) GTEST_SKIP() << "no plant (TESSERA_TEST_DATA, or shared/data beside the project)";
        options.assetFolders.push_back(data + "/plant");
    }
    Expected<ImportedScene> scene = importScene(std::string(TESSERA_SOURCE_DIR) + "/" + file, kRootNode, options);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->hasCamera);
    EXPECT_TRUE(scene->notes.empty()) << scene->notes.front();
    const ImportedAspect aspect(std::move(*scene));
    std::size_t freeBodies = 0, interests = 0;
    for (const ObjectId id : aspect->ids()) {
        if (const auto* object = aspect->get<CollisionObject>(id)) {
            EXPECT_TRUE(object->node);
            freeBodies += object->mass > 0;
        }
        interests += aspect->get<Interest>(id) != nullptr;
    }
    EXPECT_EQ(freeBodies, GetParam().freeBodies);
    EXPECT_EQ(interests, GetParam().interests);
}

INSTANTIATE_TEST_SUITE_P(
    All, ShippedScene,
    testing::Values(Shipped{"deploy/scenes/engine-hall.tsct", 0, 2}, Shipped{"deploy/scenes/engine-apart.tsct", 0, 7},
                    Shipped{"deploy/scenes/chess.tsct", 21, 4}, Shipped{"deploy/scenes/hall-by-hand.tsct", 0, 3},
                    Shipped{"deploy/scenes/materials.tsct", 0, 0}, Shipped{"deploy/scenes/lights.tsct", 0, 0},
                    Shipped{"deploy/scenes/groups.tsct", 0, 0}, Shipped{"deploy/scenes/letters.tsct", 0, 0},
                    Shipped{"deploy/scenes/moving.tsct", 0, 1}, Shipped{"deploy/scenes/particles.tsct", 0, 0},
                    Shipped{"deploy/scenes/volume.tsct", 0, 0}, Shipped{"deploy/scenes/village/village.tsct", 0, 0},
                    Shipped{"deploy/scenes/pictures.tsct", 0, 0}, Shipped{"deploy/scenes/gloss.tsct", 0, 0},
                    Shipped{"deploy/scenes/city.tsct", 0, 0}, Shipped{"deploy/scenes/plant.tsct", 0, 0},
                    Shipped{"deploy/scenes/scan.tsct", 0, 1}, Shipped{"deploy/scenes/turbine.tsct", 0, 3},
                    Shipped{"deploy/scenes/rearing.tsct", 0, 3}, Shipped{"deploy/scenes/techniques.tsct", 0, 18},
                    Shipped{"deploy/scenes/modes.tsct", 0, 6}, Shipped{"deploy/scenes/pour-1000.tsct", 1000, 3},
                    Shipped{"deploy/scenes/pour-10000.tsct", 10000, 3},
                    Shipped{"tests/data/scenes/collisions.tsct", 3, 7}),
    [](const auto& test) {
        std::string name = std::filesystem::path(test.param.file).stem().string();
        for (char& c : name)
            if (c == '-') c = '_';
        return name;
    });

}  // namespace
}  // namespace tessera

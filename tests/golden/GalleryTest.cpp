// Every room of the gallery (deploy/scenes/gallery): a 2x2 wall's picture is the 1x1 wall's, byte for byte, and near
// the stored one. Who means to change looks: TESSERA_WRITE_PICTURES=1 bin/golden --gtest_filter='Gallery.*', and look
// at them.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <vector>

#include "server/manipulators/ManipulatorDisplay.h"
#include "tests/golden/PictureDifference.h"
#include "tests/golden/ShippedScene.h"
#include "tests/golden/Stage.h"

namespace tessera::test {
namespace {

constexpr int kRoomWidthPx = 320, kRoomHeightPx = 180;

std::vector<std::string> rooms() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(TESSERA_SOURCE_DIR "/deploy/scenes/gallery"))
        if (entry.path().extension() == ".tsct") names.push_back(entry.path().stem().string());
    std::ranges::sort(names);
    return names;
}

/// With the handles that a server makes for manipulators.
void addHandles(Aspect& scene) {
    ManipulatorDisplay display;
    display.sceneChanged(scene, nullptr);
    ChangeList list = display.update(scene);
    std::uint64_t free = 2;
    for (const ObjectId id : scene.ids()) free = std::max(free, id.value + 1);
    replaceIds(list,
               [&](ObjectId id) { return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + free} : id; });
    ASSERT_FALSE(list.empty());
    const Expected<void> applied = scene.apply(list);
    ASSERT_TRUE(applied) << applied.error().message;
}

/// Whoever adds a type adds a room. ApplicationData is nothing to be seen; a Group is as a node without a core, which
/// texts write.
TEST(Gallery, HoldsEveryType) {
    const Expected<Aspect> gallery = loadShipped("gallery");
    ASSERT_TRUE(gallery) << gallery.error().message;
    std::set<ObjectType> held;
    for (const ObjectId id : gallery->ids()) held.insert(gallery->find(id).info().type);
    for (const TypeInfo& type : allTypes())
        EXPECT_TRUE(held.contains(type.type) || type.type == typeOf<ApplicationData>() || type.type == typeOf<Group>())
            << type.name;
}

/// Whoever adds a word to a field shows it in a room; of materials every field is another than it is by default in
/// some. How things collide is nothing to be seen; when a file comes, and what of it has, are the server's to say, as
/// what a program is worth.
TEST(Gallery, HoldsEveryWordOfLooks) {
    const Expected<Aspect> gallery = loadShipped("gallery");
    ASSERT_TRUE(gallery) << gallery.error().message;
    std::map<const FieldEntry*, std::set<std::int64_t>> held;
    std::set<const FieldEntry*> other;
    for (const ObjectId id : gallery->ids()) {
        const Object object = gallery->find(id);
        for (const FieldEntry& field : object.info().fields) {
            const FieldValue value = field.load(object);
            if (value != field.load(object.info().freshObject())) other.insert(&field);
            if (const auto* number = std::get_if<std::int64_t>(&value)) held[&field].insert(*number);
        }
    }
    const std::set<ObjectType> unseen{typeOf<CollisionObject>(), typeOf<Interest>(), typeOf<Inline>(),
                                      typeOf<ProxyGroup>(), typeOf<SurfaceProgram>()};
    for (const TypeInfo& type : allTypes())
        for (const FieldEntry& field : type.fields) {
            EXPECT_TRUE(other.contains(&field) || type.type != typeOf<Material>()) << "Material." << field.name;
            for (const FieldWord& word : field.words())
                EXPECT_TRUE(held[&field].contains(word.number) || unseen.contains(type.type))
                    << type.name << "." << field.name << " " << word.word;
        }
}

TEST(Gallery, EachRoomIsTheSameOnEveryWallAndLooksAsItDid) {
    Expected<Aspect> gallery = loadShipped("gallery");
    ASSERT_TRUE(gallery) << gallery.error().message;
    addHandles(*gallery);
    RenderScene scene;
    scene.update(*gallery, nullptr);
    const std::vector<std::string> names = rooms();
    ASSERT_GE(names.size(), 20u);
    Stage stage(4);
    for (std::size_t room = 0; room < names.size(); ++room) {
        SCOPED_TRACE(names[room]);
        const View view = viewOfRoom(*gallery, room);
        const bool ownPlace = room == 0 || view.position != viewOfRoom(*gallery, room - 1).position;
        EXPECT_TRUE(ownPlace) << "make-gallery.py has not been run for this room";
        const ScreenCamera camera =
            screenCamera(flatScreen(1, 1, kRoomWidthPx, kRoomHeightPx), User(), Eye::kCenter, view);
        const PixelRect all{.x = 0, .y = 0, .width = kRoomWidthPx, .height = kRoomHeightPx};
        const Picture whole = drawPart(stage, *gallery, scene, CullerKind::kMasked, camera, all);
        EXPECT_GT(lookOf(whole).spread, 20) << "a picture of nothing";
        Picture tiled = Picture::filled(kRoomWidthPx, kRoomHeightPx, 255, 0, 255);
        for (int y = 0; y < 2; ++y)
            for (int x = 0; x < 2; ++x) {
                const PixelRect part{.x = x * kRoomWidthPx / 2,
                                     .y = y * kRoomHeightPx / 2,
                                     .width = kRoomWidthPx / 2,
                                     .height = kRoomHeightPx / 2};
                // Rectangles count from below, pictures from above.
                paste(tiled, drawPart(stage, *gallery, scene, CullerKind::kMasked, camera, part), part.x,
                      kRoomHeightPx - part.y - part.height);
            }
        EXPECT_EQ(tiled.rgb, whole.rgb) << "2x2 and 1x1";

        const std::string stored = TESSERA_SOURCE_DIR "/tests/golden/pictures/gallery/" + names[room] + ".png";
        if (std::getenv("TESSERA_WRITE_PICTURES")) {
            std::filesystem::create_directories(std::filesystem::path(stored).parent_path());
            ASSERT_TRUE(writeFile(stored, encodePng(whole, std::nullopt)));
            continue;
        }
        expectNear(whole, stored, names[room]);
    }
}

}  // namespace
}  // namespace tessera::test

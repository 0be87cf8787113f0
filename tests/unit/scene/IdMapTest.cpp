#include "common/cores/PointLight.h"
#include "common/scene/IdMap.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "common/scene/Column.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

// Beside a std::map: runs, gaps, the highest ids, and references that hold while others come.
TEST(IdMap, IsAMap) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 20; ++round) {
        IdMap<std::uint64_t> map;
        std::map<ObjectId, std::uint64_t> plain;
        const std::uint64_t spread = std::uint64_t{1} << (round * 3);
        std::uint64_t* first = nullptr;
        for (int i = 0; i < 3000; ++i) {
            const ObjectId id{random() % 3 == 0 ? ~std::uint64_t{0} - random() % spread : random() % spread};
            EXPECT_EQ(map.find(id) != nullptr, plain.contains(id));
            const auto [value, isNew] = map.add(id);
            EXPECT_EQ(isNew, plain.try_emplace(id, 0).second);
            EXPECT_EQ(value, plain[id]);
            value = plain[id] = random();
            if (!first) first = &value;
        }
        EXPECT_TRUE(std::ranges::any_of(plain, [&](const auto& entry) { return map.find(entry.first) == first; }));
        EXPECT_EQ(map.size(), plain.size());
        std::size_t seen = 0;
        map.forEach([&](ObjectId id, std::uint64_t value) {
            ++seen;
            EXPECT_EQ(plain.at(id), value);
        });
        EXPECT_EQ(seen, plain.size());
    }
}

TEST(Column, IsWhatABuilderMakes) {
    ChangeListBuilder builder;
    Column<&Transform::translation> translations(3);
    Column<&Transform::rotation> rotations(3);
    Column<&Node::core> cores(3);
    Column<&Node::name> names(3);
    Column<&PointLight::intensity> intensities(3);
    for (std::uint64_t i = 0; i < 5; ++i) {
        const ObjectId id(10 + 7 * i % 5);
        const Vec3d t(0.1 * double(i), -0.0, 3);
        const Quatd r(0.5, 0.25 * double(i), -1, 2);
        setField<&Transform::translation>(builder, id, t);
        setField<&Transform::rotation>(builder, id, r);
        setField<&Node::core>(builder, id, ObjectId(99 + i));
        setField<&Node::name>(builder, id, std::string(i, 'x'));
        setField<&PointLight::intensity>(builder, id, float(i));
        translations.add(id, t);
        rotations.add(id, r);
        cores.add(id, ObjectId(99 + i));
        names.add(id, std::string(i, 'x'));
        intensities.add(id, float(i));
    }
    // What toValue says is the same, too.
    builder.set(ObjectId(12), typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(Quatd(1, 2, 3, 4)));
    const ChangeList list = builder.take();
    FieldColumn rotation = rotations.take();
    rotation.assign(static_cast<std::size_t>(std::ranges::find(rotation.ids, ObjectId(12)) - rotation.ids.begin()),
                    toValue(Quatd(1, 2, 3, 4)));
    for (const FieldColumn& column : {translations.take(), rotation, cores.take(), names.take(), intensities.take()})
        EXPECT_TRUE(std::ranges::count(list.columns, column) == 1) << column.type.value << " " << column.field.value;
}

}  // namespace
}  // namespace tessera

#include "server/sim/frame/Wishes.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(Wishes, WaysOfATransformLeadThereOneAfterTheOther) {
    Wishes wishes;
    for (int frame = 0; frame < 3; ++frame) {
        const std::size_t many = frame == 0 ? 100'000 : 3;
        for (std::size_t i = 0; i < many; ++i) {
            Wish& wish = wishes.add(ObjectId(many - i)).value;
            ASSERT_EQ(wishes.lastWay(wish), nullptr);
            for (std::size_t edit = 0; edit < i % 3; ++edit) {
                Pose from;
                from.translation.x() = static_cast<double>(i + edit);
                wishes.addWay(wish, edit, from);
            }
        }
        for (std::size_t i = 0; i < many; ++i) {
            const Wish* wish = wishes.find(ObjectId(many - i));
            ASSERT_NE(wish, nullptr);
            std::size_t left = i % 3;
            for (const Wishes::Way* way = wishes.lastWay(*wish); way; way = wishes.wayBefore(*way)) {
                ASSERT_EQ(way->edit, --left);
                ASSERT_EQ(way->from.translation.x(), static_cast<double>(i + left));
            }
            ASSERT_EQ(left, 0u);
        }
        wishes.clear();
        ASSERT_TRUE(wishes.empty());
        ASSERT_EQ(wishes.find(ObjectId(1)), nullptr);
    }
}

}  // namespace
}  // namespace tessera

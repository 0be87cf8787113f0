/// A scene of things with programs, whose notices tests look at.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "common/drawable/SceneBounds.h"
#include "common/scene/Action.h"
#include "common/scene/Edits.h"
#include "server/programs/ProgramNotices.h"
#include "server/sim/frame/Simulation.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera::test {

/// Boxes with programs of their own, and a server's frames.
struct Shop {
    explicit Shop(std::size_t boxes = 1) {
        ListMaker make;
        for (std::size_t i = 0; i < boxes; ++i) {
            const ObjectId program = make.create<SurfaceProgram>();
            setField<&SurfaceProgram::surface>(make.builder, program, "text " + std::to_string(i));
            const ObjectId material = make.create<Material>();
            setField<&Material::program>(make.builder, material, program);
            const ObjectId core = make.box(Vec3d(1, 1, 1));
            setField<&Geometry::material>(make.builder, core, material);
            const ObjectId place = make.node("thing" + std::to_string(i), kRootNode,
                                             make.transform(Vec3d(3.0 * static_cast<double>(i), 0, -5)));
            (void)make.node("box", place, core);
            (void)make.node("twin", place, core);
        }
        EXPECT_TRUE(simulation.load({make.builder.take()}));
        notices.update(scene(), nullptr);
        for (const ObjectId id : scene().ids())
            if (scene().get<SurfaceProgram>(id)) programs.push_back(id);
        std::ranges::sort(programs);
        view.users = wall.users;
    }
    [[nodiscard]] const Aspect& scene() const { return simulation.scene(); }
    void frame(std::vector<Edit> edits = {}) {
        if (ChangeList list = notices.notices(scene(), view); !list.empty()) {
            ++lists;
            edits.insert(edits.begin(),
                         Edit{.ticket = ProgramNotices::kTicket, .list = std::move(list), .undoable = false});
        }
        const FrameResult made = simulation.step(std::exchange(begin, false), std::move(edits));
        for (const EditOutcome& outcome : made.outcomes) EXPECT_TRUE(outcome.result) << outcome.result.error().message;
        if (made.commit.list) notices.update(scene(), made.commit.list.get());
    }
    void frames(int count = 2 * ProgramNotices::kPatience) {
        for (int i = 0; i < count; ++i) frame();
    }
    void verdict(std::size_t which, std::int64_t verdict, const std::string& problem = "") {
        ChangeListBuilder list;
        setField<&SurfaceProgram::verdict>(list, programs.at(which), verdict);
        setField<&SurfaceProgram::problem>(list, programs.at(which), problem);
        frame(test::one(Edit{.ticket = 9, .list = list.take(), .undoable = false}));
        frame();
    }
    [[nodiscard]] ObjectId top() const {
        for (std::size_t i = 0; i < scene().root().children.size(); ++i)
            if (scene().get<Node>(scene().root().children[i])->ofServer) return scene().root().children[i];
        return {};
    }
    [[nodiscard]] std::vector<Text> texts() const {
        std::vector<Text> all;
        Action action;
        action.on<Text>([&](const Visit&, const Text& text) {
            all.push_back(text);
            return Descend::kInto;
        });
        if (top()) action.run(scene(), top());
        return all;
    }
    [[nodiscard]] Box seen() const { return sceneBounds(scene(), top()); }
    [[nodiscard]] Vec3d eye() const { return view.world_T_wall() * view.users.front().position; }
    /// Of a sheet, turned to the first user's eye as hosts do it.
    struct SeenPlate {
        Box onScreen;                    ///< m, from the first screen's lower left corner, to the right and up
        double least = 1e300, most = 0;  ///< m: depth of its nearest corner, distance of its farthest
    };
    [[nodiscard]] std::vector<SeenPlate> plates() const {
        const Screen& screen = wall.screens.front();
        const Vec3d right = (screen.lowerRight - screen.lowerLeft).normalized(),
                    up = (screen.upperLeft - screen.lowerLeft).normalized();
        const Vec3d into = up.cross(right);
        const Vec3d head = view.users.front().position;
        const Affine3d wall_T_world = view.world_T_wall().inverse();
        std::vector<SeenPlate> all;
        Action action;
        action.on<Geometry>([&](const Visit& visit, const Geometry& plate) {
            const Vec3d middle = visit.world_T_node.translation(), towards = (eye() - middle).normalized();
            const Vec3d across = Vec3d::UnitY().cross(towards).normalized(), upward = towards.cross(across);
            const Vec3d size = visit.world_T_node.linear().colwise().norm();
            SeenPlate seen;
            const std::span<const float> corners = plate.positions.as<float>();
            for (std::size_t c = 0; c < corners.size(); c += 3) {
                const Vec3d way =
                    wall_T_world * Vec3d(middle + corners[c] * size.x() * across + corners[c + 1] * size.y() * upward) -
                    head;
                const Vec3d on = head + into.dot(screen.lowerLeft - head) / into.dot(way) * way - screen.lowerLeft;
                seen.onScreen.extend(Vec3d(right.dot(on), up.dot(on), 0));
                seen.least = std::min(seen.least, into.dot(way));
                seen.most = std::max(seen.most, way.norm());
            }
            all.push_back(seen);
            return Descend::kInto;
        });
        if (top()) action.run(scene(), top());
        return all;
    }

    Wall wall = test::wallOfOne();
    View view;
    Simulation simulation;
    ProgramNotices notices{wall};
    std::vector<ObjectId> programs;
    bool begin = true;
    int lists = 0;
};

}  // namespace tessera::test

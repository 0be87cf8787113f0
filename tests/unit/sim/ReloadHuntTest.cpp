// A file that is read again, of random content, with random edits in between: what must come of it, worked out by
// names.
#include <map>
#include <set>

#include "tests/property/Seeds.h"
#include "tests/unit/sim/FileAtWork.h"

namespace tessera::test {
namespace {

class Hunt {
public:
    explicit Hunt(std::uint64_t seed) : random(seed) {}

    Random random;

    Said some(int depth) {
        Said said{.name = "n" + std::to_string(next_++), .at = place()};
        if (oneIn(random, 3)) said.box = 1 + static_cast<double>(below(random, 3));
        if (said.box && oneIn(random, 2)) said.rough = static_cast<float>(below(random, 4)) / 4;
        while (depth > 0 && oneIn(random, 2)) said.below.push_back(some(depth - 1));
        return said;
    }
    Vec3d place() { return Vec3d(static_cast<double>(below(random, 100)), 0, 0); }

    void change(std::vector<Said>& siblings, int depth) {
        for (std::size_t i = 0; i < siblings.size();) {
            Said& said = siblings[i];
            if (oneIn(random, 8)) {
                siblings.erase(siblings.begin() + static_cast<std::ptrdiff_t>(i));
                continue;
            }
            if (oneIn(random, 4)) said.at = place();
            if (oneIn(random, 6))
                said.box = oneIn(random, 3) ? std::nullopt : std::optional(1 + static_cast<double>(below(random, 3)));
            if (said.box && oneIn(random, 6))
                said.rough = oneIn(random, 3) ? std::nullopt : std::optional(static_cast<float>(below(random, 4)) / 4);
            if (!said.box) said.rough.reset();
            change(said.below, depth - 1);
            ++i;
        }
        if (oneIn(random, 3))
            siblings.insert(siblings.begin() + static_cast<std::ptrdiff_t>(below(random, siblings.size() + 1)),
                            some(std::max(depth, 0)));
        if (siblings.size() > 1 && oneIn(random, 5))
            std::swap(siblings[below(random, siblings.size())], siblings[below(random, siblings.size())]);
    }

private:
    int next_ = 0;
};

/// Of a file: where each node stands, by its path.
void placesOf(const std::vector<Said>& siblings, const std::string& above, std::map<std::string, Said>& all) {
    for (const Said& said : siblings) {
        all[above + "/" + said.name] = said;
        placesOf(said.below, above + "/" + said.name, all);
    }
}

void hunt(std::uint64_t seed, const ReloadPlan::Limits& limits) {
    Hunt hunt(seed);
    std::vector<Said> file;
    for (int i = 0; i < 3; ++i) file.push_back(hunt.some(3));
    FileAtWork work(file);
    std::map<std::string, Vec3d> moved;  // by people, since the file last said the same
    std::set<std::string> removed;       // by people
    std::set<std::string> mine;          // nodes of people
    for (int round = 0; round < 4; ++round) {
        std::map<std::string, Said> was, is;
        placesOf(file, "", was);
        // People, at random. Of what was removed before they know nothing any more.
        for (const auto& [path, said] : was) {
            const ObjectId node = work.node(path);
            if (!node || removed.contains(path)) continue;
            if (oneIn(hunt.random, 10)) {
                moved[path] = Vec3d(0, 1 + static_cast<double>(below(hunt.random, 5)), 0);
                work.set<&Transform::translation>(work.core(path), moved[path]);
            }
            if (oneIn(hunt.random, 14)) {
                const std::string name = "mine" + std::to_string(mine.size());
                work.add(name, path);
                mine.insert(path + "/" + name);
            }
            if (oneIn(hunt.random, 20)) {
                work.remove(path);
                for (const auto& [other, ignored] : was)
                    if (other == path || other.starts_with(path + "/")) removed.insert(other);
                std::erase_if(mine, [&, path = path](const std::string& one) { return one.starts_with(path + "/"); });
            }
        }
        std::map<std::string, ObjectId> ids;
        for (const auto& [path, said] : was)
            if (const ObjectId node = work.node(path)) ids[path] = node;

        hunt.change(file, 2);
        placesOf(file, "", is);
        const ReloadPlan plan = work.becomes(file, limits);
        ASSERT_FALSE(testing::Test::HasFailure());

        const auto below = [](const std::set<std::string>& paths, const std::string& path) {
            return std::ranges::any_of(paths, [&](const std::string& one) { return one.starts_with(path + "/"); });
        };
        const auto belowRemoved = [&](std::string path) {
            for (;; path.resize(path.rfind('/'))) {
                if (path.empty()) return false;
                if (removed.contains(path)) return true;
            }
        };
        std::size_t conflicts = 0;
        for (const auto& [path, said] : is) {
            const ObjectId node = work.node(path);
            if (belowRemoved(path)) {
                ASSERT_FALSE(node) << path << " was removed here";
                continue;
            }
            ASSERT_TRUE(node) << path << " is in the file";
            const auto before = was.find(path);
            if (before != was.end()) {
                ASSERT_EQ(node, ids.at(path)) << path << " keeps its id";
            }
            const Vec3d now = work.scene().get<Transform>(work.core(path))->translation;
            const bool changed = before != was.end() && before->second.at != said.at;
            if (moved.contains(path) && before != was.end()) {
                ASSERT_EQ(now, moved.at(path)) << path << " is where people put it";
                if (changed && said.at != moved.at(path)) {
                    ++conflicts;
                    if (plan.notes.size() < ReloadPlan::kMostNotes) {
                        ASSERT_NE(allNotes(plan).find("the Transform of " + path + ": translation stays"),
                                  std::string::npos)
                            << allNotes(plan);
                    }
                }
            } else {
                moved.erase(path);
                ASSERT_EQ(now, said.at) << path << " is where the file puts it";
            }
            if (!removed.contains(path + "/shape")) {
                const Geometry* shape = work.scene().get<Geometry>(work.core(path + "/shape"));
                ASSERT_EQ(shape != nullptr, said.box.has_value()) << path;
                if (shape) {
                    ASSERT_EQ(shape->positions, makeBox(Vec3d::Constant(*said.box)).toArrays().positions) << path;
                    ASSERT_EQ(static_cast<bool>(shape->material), said.rough.has_value()) << path;
                    if (said.rough) {
                        ASSERT_EQ(work.scene().get<Material>(shape->material)->roughness, *said.rough) << path;
                    }
                }
            }
            // In the file's order, whatever people have put between.
            Names order, wanted;
            for (const std::string& name : work.below(path))
                if (is.contains(path + "/" + name)) order.push_back(name);
            for (const Said& child : said.below)
                if (!belowRemoved(path + "/" + child.name)) wanted.push_back(child.name);
            ASSERT_EQ(order, wanted) << path;
        }
        ASSERT_EQ(plan.kept, conflicts) << allNotes(plan);
        for (const auto& [path, id] : ids) {
            if (is.contains(path)) continue;
            ASSERT_EQ(static_cast<bool>(work.node(path)), below(mine, path)) << path << " has gone from the file";
            if (below(mine, path)) {  // nobody's of the file any more
                mine.insert(path);
                moved.erase(path);
            }
        }
        for (const std::string& path : mine) ASSERT_TRUE(work.node(path)) << path << " is people's";
        // What went, people's or not, may come again under its name; what stays as people's is in its way by name
        // alone.
        std::erase_if(removed,
                      [&](const std::string& path) { return !is.contains(path) && !path.ends_with("/shape"); });
        if (std::ranges::any_of(mine, [&](const std::string& path) { return path.find("/mine") == std::string::npos; }))
            return;
        // Nothing is left over that nobody uses.
        for (const ObjectId id : work.scene().ids()) {
            if (work.scene().get<Node>(id)) continue;
            ASSERT_GT(work.scene().useCount(id), 0u) << "#" << id.value;
        }
    }
}

TEST(ReloadPlan, HuntsOverFilesAndPeople) {
    forSeeds(400, [](Random& random) { hunt(random(), {}); });
}

TEST(ReloadPlan, HuntsInParts) {
    forSeeds(400, [](Random& random) { hunt(random(), {.changes = 3, .whole = 0}); });
}

}  // namespace
}  // namespace tessera::test

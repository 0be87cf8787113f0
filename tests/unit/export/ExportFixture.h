/// What the tests of writers share: files read back by our own importer, scenes compared as a reader sees them, and the
/// validator of glTF's makers.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "common/cores/Animation.h"
#include "common/cores/ComponentTransform.h"
#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Group.h"
#include "common/cores/Transform.h"
#include "common/export/Export.h"
#include "common/scene/Action.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {

/// What a script of this folder says of files, by a package of npm's.
struct Validated {
    bool there = false;  ///< the package is installed
    bool good = false;
    std::string said;
};
inline Validated validated(const std::vector<std::string>& files, const std::string& script = "validate-gltf.cjs") {
    std::string command = std::string("node ") + TESSERA_SOURCE_DIR + "/tests/unit/export/" + script;
    for (const std::string& file : files) command += " '" + file + "'";
    Validated result;
    FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
    if (pipe == nullptr) return result;
    char buffer[4096];
    for (std::size_t got = 0; (got = std::fread(buffer, 1, sizeof(buffer), pipe)) > 0;) result.said.append(buffer, got);
    const int status = ::pclose(pipe);
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    result.there = code != 77 && code != 127;
    result.good = code == 0;
    return result;
}

/// What our importer makes of a file.
inline ImportedAspect readBack(const std::string& path) {
    Expected<ImportedScene> again = importScene(path, kRootNode, importOptions());
    EXPECT_TRUE(again) << messageOf(again);
    return ImportedAspect(again ? std::move(*again) : ImportedScene());
}

/// Whether two scenes are the same for who looks at them: names, order, places, arrays, looks, lights, animations, and
/// which objects are shared. Groups and transforms are where they put things, animations play wherever they stand;
/// surroundings are nothing.
class Likeness {
public:
    Likeness(const Aspect& a, const Aspect& b) : a_(a), b_(b) {}

    /// The first difference below two nodes, in words; empty: none.
    std::string below(ObjectId a, ObjectId b) {
        children(a, b, pathOf(a_, a));
        animations(a, b);
        while (said_.empty() && !open_.empty()) {
            const auto [x, y, path] = open_.back();
            open_.pop_back();
            object(x, y, path);
        }
        return said_;
    }

private:
    static bool near(double x, double y) { return std::abs(x - y) <= 2e-5 * std::max({1.0, std::abs(x), std::abs(y)}); }
    void say(const std::string& path, std::string_view what) {
        if (said_.empty()) said_ = fmt::format("{}: {}", path, what);
    }
    static std::vector<ObjectId> shown(const Aspect& scene, ObjectId node) {
        std::vector<ObjectId> kept;
        for (const ObjectId child : scene.get<Node>(node)->children)
            if (const Node& below = *scene.get<Node>(child);
                !scene.coreOf<Environment>(below) && !scene.coreOf<Animation>(below))
                kept.push_back(child);
        return kept;
    }
    static void findAnimations(const Aspect& scene, ObjectId top, std::vector<ObjectId>& found) {
        const Node& node = *scene.get<Node>(top);
        if (scene.coreOf<Animation>(node)) found.push_back(top);
        for (const ObjectId child : node.children) findAnimations(scene, child, found);
    }
    void animations(ObjectId x, ObjectId y) {
        std::vector<ObjectId> of, other;
        findAnimations(a_, x, of), findAnimations(b_, y, other);
        if (of.size() != other.size())
            return say("", fmt::format("{} animations, {} in the other", of.size(), other.size()));
        for (std::size_t i = 0; i < of.size(); ++i) {
            const Node &left = *a_.get<Node>(of[i]), &right = *b_.get<Node>(other[i]);
            if (left.name != right.name) say(left.name, "the other is called " + right.name);
            if (pair(left.core, right.core)) open_.emplace_back(left.core, right.core, left.name);
        }
    }
    static bool isPlace(const Object& core) {
        return !core || core.is<Group>() || core.is<Transform>() || core.is<ComponentTransform>();
    }
    void children(ObjectId x, ObjectId y, const std::string& path) {
        const std::vector<ObjectId> of = shown(a_, x), other = shown(b_, y);
        if (of.size() != other.size())
            return say(path, fmt::format("{} children, {} in the other", of.size(), other.size()));
        for (std::size_t i = 0; i < of.size(); ++i) node(of[i], other[i], path);
    }
    void node(ObjectId x, ObjectId y, const std::string& above) {
        const Node &left = *a_.get<Node>(x), &right = *b_.get<Node>(y);
        const std::string path = above + "/" + left.name;
        if (left.name != right.name) return say(path, "the other is called " + right.name);
        pairs_[x] = y;
        const Affine3d here = worldTransform(a_, x), there = worldTransform(b_, y);
        for (int i = 0; i < 12; ++i)
            if (!near(here.matrix()(i / 4, i % 4), there.matrix()(i / 4, i % 4)))
                return say(path, "it stands elsewhere");
        const Object core = a_.find(left.core), other = b_.find(right.core);
        if (isPlace(core) && isPlace(other)) {
            if (core && other) pair(left.core, right.core);
        } else if (!core || !other || core.info().type != other.info().type) {
            return say(path, fmt::format("{}, {} in the other", core ? core.info().name : "nothing",
                                         other ? other.info().name : "nothing"));
        } else if (pair(left.core, right.core)) {
            open_.emplace_back(left.core, right.core, path);
        } else if (pairs_[left.core] != right.core) {
            return say(path, "the core is shared otherwise");
        }
        children(x, y, path);
    }
    /// True: for the first time.
    bool pair(ObjectId x, ObjectId y) {
        const auto [at, isNew] = pairs_.try_emplace(x, y);
        return isNew;
    }
    void follow(ObjectId x, ObjectId y, const std::string& path) {
        if (!x != !y) return say(path, "a reference leads nowhere in one");
        if (!x) return;
        if (a_.find(x).is<Node>() || isPlace(a_.find(x))) {
            if (pairs_.contains(x) && pairs_[x] != y) say(path, "a reference leads elsewhere");
            return;
        }
        if (pair(x, y)) open_.emplace_back(x, y, path);
    }
    void blobs(const FieldEntry& field, const Blob& x, const Blob& y, const std::string& path, bool turns) {
        if (x == y) return;
        if (x.sizeBytes() != y.sizeBytes())
            return say(path, fmt::format("{} has {} bytes, {} in the other", field.name, x.sizeBytes(), y.sizeBytes()));
        const auto nearAll = [&](const auto& left, const auto& right) {
            for (std::size_t i = 0; i < left.size(); ++i)
                if (!near(left[i], right[i]))
                    return say(path, fmt::format("{}[{}] is {}, {} in the other", field.name, i, left[i], right[i]));
        };
        // Weights count by their share, rotations by their direction.
        if (field.name == "jointWeights") return nearAll(inFours(x.as<float>(), 1), inFours(y.as<float>(), 1));
        if (field.name == "values" && turns) return nearAll(inFours(x.as<double>(), 2), inFours(y.as<double>(), 2));
        if (field.name == "times" || field.name == "values") return nearAll(x.as<double>(), y.as<double>());
        if (field.name == "indices") {
            if (sorted(x) != sorted(y)) say(path, "other triangles");
            return;
        }
        if (field.name == "normals" || field.name == "tangents" || field.name == "pose" || field.name == "inverseBinds")
            return nearAll(x.as<float>(), y.as<float>());
        say(path, fmt::format("{} has other bytes", field.name));
    }
    /// Four numbers each, over their sum or length, where that is no tangent's.
    template <typename Numbers>
    static std::vector<double> inFours(const Numbers& numbers, int power) {
        std::vector<double> all(numbers.begin(), numbers.end());
        for (std::size_t i = 0; i + 4 <= all.size(); i += 4) {
            double size = 0;
            for (std::size_t k = i; k < i + 4; ++k) size += power == 2 ? all[k] * all[k] : all[k];
            size = power == 2 ? std::sqrt(size) : size;
            if (power == 2 && std::abs(size - 1) > 0.01) continue;
            for (std::size_t k = i; k < i + 4; ++k) all[k] /= size;
        }
        return all;
    }
    /// Triangles in any order, each from its least corner.
    static std::vector<std::array<std::uint32_t, 3>> sorted(const Blob& indices) {
        const auto all = indices.as<std::uint32_t>();
        std::vector<std::array<std::uint32_t, 3>> triangles;
        for (std::size_t i = 0; i + 3 <= all.size(); i += 3) {
            std::array<std::uint32_t, 3> t{all[i], all[i + 1], all[i + 2]};
            std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
            triangles.push_back(t);
        }
        std::sort(triangles.begin(), triangles.end());
        return triangles;
    }
    void object(ObjectId x, ObjectId y, const std::string& path) {
        const Object left = a_.find(x), right = b_.find(y);
        for (const FieldEntry& field : left.info().fields) {
            const FieldValue u = field.load(left), v = field.load(right);
            const std::string where = fmt::format("{} ({}.{})", path, left.info().name, field.name);
            if (const auto* ref = std::get_if<ObjectId>(&u)) {
                follow(*ref, std::get<ObjectId>(v), where);
            } else if (const auto* refs = std::get_if<RefList>(&u)) {
                const RefList& others = std::get<RefList>(v);
                if (refs->size() != others.size()) return say(where, "another number of references");
                for (std::size_t i = 0; i < refs->size(); ++i) follow((*refs)[i], others[i], where);
            } else if (const auto* blob = std::get_if<Blob>(&u)) {
                // Sets of coordinates are numbered without gaps: a second one alone has a first of the same.
                if (field.name == "texcoords" && blob->empty() && left.is<Geometry>() &&
                    right.as<Geometry>()->texcoords == left.as<Geometry>()->texcoords1)
                    continue;
                blobs(field, *blob, std::get<Blob>(v), where,
                      left.is<KeyFrames>() && left.as<KeyFrames>()->field == "rotation");
            } else if (const auto* floats = std::get_if<Floats>(&u)) {
                for (std::size_t i = 0; i < floats->width; ++i)
                    if (!near(floats->values[i], std::get<Floats>(v).values[i]))
                        say(where,
                            fmt::format("{}, {} in the other", floats->values[i], std::get<Floats>(v).values[i]));
            } else if (const auto* doubles = std::get_if<Doubles>(&u)) {
                for (std::size_t i = 0; i < doubles->width; ++i)
                    if (!near(doubles->values[i], std::get<Doubles>(v).values[i]))
                        say(where,
                            fmt::format("{}, {} in the other", doubles->values[i], std::get<Doubles>(v).values[i]));
            } else if (u != v) {
                say(where, "differs");
            }
        }
    }

    const Aspect &a_, &b_;
    std::string said_;
    std::map<ObjectId, ObjectId> pairs_;
    std::vector<std::tuple<ObjectId, ObjectId, std::string>> open_;
};

}  // namespace tessera

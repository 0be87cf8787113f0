/// What looking at an edit costs (`checkRules`), in a small scene and in a large one: bench_rules [--small N] [--large
/// N] [--edits N] [--json FILE]. Medians, in µs.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/cores/Animation.h"
#include "common/cores/Image.h"
#include "common/cores/Manipulator.h"
#include "common/cores/Material.h"
#include "common/cores/Movie.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "server/rules/SceneRules.h"
#include "tests/bench/CaseFile.h"

namespace tessera {
namespace {

using Clock = std::chrono::steady_clock;

/// So many nodes with a Transform each, and one of each thing that has rules.
struct Stage {
    Aspect scene;
    ObjectId node, material, pass, image, movie, frames, manipulator;
    std::vector<ObjectId> nodes;
    std::set<ObjectId> movies;

    explicit Stage(std::size_t count) {
        ChangeListBuilder list;
        std::uint64_t next = kRootNode.value;
        const auto make = [&](ObjectType type) {
            const ObjectId id{++next};
            list.create(id, type);
            return id;
        };
        const auto set = [&](ObjectId id, ObjectType type, FieldId field, const FieldValue& value) {
            list.set(id, type, field, value);
        };
        for (std::size_t i = 0; i < count; ++i) {
            nodes.push_back(make(typeOf<Node>()));
            const ObjectId core = make(typeOf<Transform>());
            set(nodes.back(), typeOf<Node>(), fieldId<&Node::core>, toValue(core));
            set(nodes.back(), typeOf<Node>(), fieldId<&Node::name>, std::string("node"));
            list.place(nodes.back(), i % 100 == 0 ? kRootNode : nodes[i / 100 * 100]);
        }
        node = nodes[count / 2];
        image = make(typeOf<Image>());
        material = make(typeOf<Material>());
        pass = make(typeOf<Material>());
        set(material, typeOf<Material>(), fieldId<&Material::baseColorImage>, toValue(image));
        movie = make(typeOf<Movie>());
        movies = {movie, make(typeOf<Movie>())};
        frames = make(typeOf<KeyFrames>());
        manipulator = make(typeOf<Manipulator>());
        if (const Expected<void> made = scene.apply(list.take()); !made) {
            fmt::print(stderr, "{}\n", made.error().message);
            std::exit(1);
        }
    }
};

struct Row {
    const char* name;
    std::function<ChangeList(const Stage&)> edit;
};

template <typename Value>
ChangeList oneField(ObjectId id, ObjectType type, FieldId field, const Value& value) {
    ChangeListBuilder list;
    list.set(id, type, field, FieldValue(value));
    return list.take();
}

double median(const Stage& stage, const ChangeList& edit, int times) {
    std::vector<double> taken;
    for (int i = 0; i < times; ++i) {
        const Clock::time_point begun = Clock::now();
        const auto sound = checkRules(stage.scene, edit, stage.movies);
        taken.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begun).count());
        if (!sound) {
            fmt::print(stderr, "bench_rules: {}\n", sound.error().why.message);
            std::exit(2);
        }
    }
    const auto middle = taken.begin() + times / 2;
    std::nth_element(taken.begin(), middle, taken.end());
    return *middle;
}

const Row kRows[] = {
    {"a node's name",
     [](const Stage& s) { return oneField(s.node, typeOf<Node>(), fieldId<&Node::name>, std::string("other")); }},
    {"a node's core",
     [](const Stage& s) {
         return oneField(s.node, typeOf<Node>(), fieldId<&Node::core>, s.scene.get<Node>(s.node)->core);
     }},
    {"a manipulator's target",
     [](const Stage& s) {
         return oneField(s.manipulator, typeOf<Manipulator>(), fieldId<&Manipulator::target>, s.node);
     }},
    {"a material's passes",
     [](const Stage& s) {
         return oneField(s.material, typeOf<Material>(), fieldId<&Material::passes>, RefList{s.pass});
     }},
    {"an image's wrapping",
     [](const Stage& s) {
         return oneField(s.image, typeOf<Image>(), fieldId<&Image::wrapU>, std::int64_t{Image::kClamp});
     }},
    {"key frames' target",
     [](const Stage& s) { return oneField(s.frames, typeOf<KeyFrames>(), fieldId<&KeyFrames::target>, s.node); }},
    {"a movie's pace",
     [](const Stage& s) { return oneField(s.movie, typeOf<Movie>(), fieldId<&Movie::speed>, toValue(2.0)); }},
    {"a movie's image, in use",
     [](const Stage& s) { return oneField(s.movie, typeOf<Movie>(), fieldId<&Movie::image>, s.image); }},
};

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    using namespace tessera;
    std::size_t small = 1'000, large = 100'000;
    int edits = 501;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string word = argv[i];
        if (word == "--small") small = static_cast<std::size_t>(std::atoll(argv[i + 1]));
        if (word == "--large") large = static_cast<std::size_t>(std::atoll(argv[i + 1]));
        if (word == "--edits") edits = std::max(1, std::atoi(argv[i + 1]));
    }
    bench::CaseFile file(argc, argv);
    const std::string peer = fmt::format("{} instead of {}", small, large);
    const Stage few(small), many(large);
    fmt::print("{:<28}{:>12}{:>12}{:>8}\n", "looking at one edit, us", small, large, "ratio");
    for (const Row& row : kRows) {
        const ChangeList here = row.edit(few), there = row.edit(many);
        const double a = median(few, here, edits), b = median(many, there, edits);
        fmt::print("{:<28}{:>12.3f}{:>12.3f}{:>8.2f}\n", row.name, a, b, b / a);
        file.add(row.name, peer, b, a, "µs");
    }
    // A file's whole list is looked at once: all nodes have a manipulator.
    std::vector<double> each;
    for (const std::size_t count : {small, large}) {
        ChangeListBuilder list;
        std::uint64_t next = kRootNode.value;
        for (std::size_t i = 0; i < count; ++i) {
            const ObjectId node{++next}, core{++next}, handle{++next};
            list.create(node, typeOf<Node>());
            list.create(core, typeOf<Transform>());
            list.create(handle, typeOf<Manipulator>());
            list.set(node, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
            list.set(handle, typeOf<Manipulator>(), fieldId<&Manipulator::target>, toValue(node));
            list.place(node, kRootNode);
        }
        const ChangeList whole = list.take();
        const Clock::time_point begun = Clock::now();
        if (const auto sound = checkRules(Aspect(), whole, {}); !sound) {
            fmt::print(stderr, "bench_rules: {}\n", sound.error().why.message);
            return 2;
        }
        const double taken = std::chrono::duration<double, std::micro>(Clock::now() - begun).count();
        each.push_back(taken / static_cast<double>(count));
        fmt::print("a file of {} manipulators: {:.3f} us each\n", count, each.back());
    }
    file.add("a file of manipulators, each of them", peer, each.back(), each.front(), "µs");
    return file.write();
}

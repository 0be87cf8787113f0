/// Models with joints, morph targets and animations, from the file through frames to vertices, beside an evaluator that
/// reads the file by itself.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "common/cores/Skin.h"
#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "server/import/Importer.h"
#include "server/sim/frame/Simulation.h"
#include "tests/unit/Sanitized.h"

namespace tessera {
namespace {

using Json = nlohmann::json;
using Wide3 = Eigen::Matrix<long double, 3, 1>;
using Wide4 = Eigen::Matrix<long double, 4, 4>;

/// What a glTF 2.0 file of one buffer says at a time: positions in the world, in the order of its nodes, primitives,
/// vertices. Reads as the specification is written, and nothing of Tessera's reader.
class FileEvaluator {
public:
    explicit FileEvaluator(const std::string& path) {
        std::ifstream in(path, std::ios::binary);
        const std::string all((std::istreambuf_iterator<char>(in)), {});
        std::string text = all;
        if (all.starts_with("glTF")) {
            std::uint32_t length = 0;
            std::memcpy(&length, &all[12], 4);
            text = all.substr(20, length);
            buffer_ = all.substr(20 + length + 8);
        }
        file_ = Json::parse(text);
        if (!all.starts_with("glTF")) {
            const std::string uri = file_["buffers"][0]["uri"];
            if (uri.starts_with("data:"))
                buffer_ = decoded(uri.substr(uri.find(',') + 1));
            else {
                std::ifstream beside(std::filesystem::path(path).parent_path() / uri, std::ios::binary);
                buffer_.assign((std::istreambuf_iterator<char>(beside)), {});
            }
        }
    }

    std::vector<Wide3> positionsAt(long double seconds) {
        nodes_ = file_["nodes"];
        if (file_.contains("animations")) play(file_["animations"][0], seconds);
        worlds_.clear();
        for (const Json& root : file_["scenes"][file_.value("scene", 0)]["nodes"]) place(root, Wide4::Identity());
        std::vector<Wide3> all;
        for (const Json& root : file_["scenes"][file_.value("scene", 0)]["nodes"]) collect(root, all);
        return all;
    }
    long double length() {
        long double last = 0;
        for (const Json& sampler : file_["animations"][0]["samplers"])
            last = std::max(last, numbers(sampler["input"]).back());
        return last;
    }

private:
    static std::string decoded(const std::string& base64) {
        const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        std::string bytes;
        unsigned bits = 0, held = 0;
        for (const char c : base64) {
            const std::size_t digit = digits.find(c);
            if (digit == std::string::npos) break;
            held = held << 6 | static_cast<unsigned>(digit);
            if ((bits += 6) >= 8) bytes.push_back(static_cast<char>(held >> (bits -= 8)));
        }
        return bytes;
    }
    static std::size_t widthOf(const std::string& type) {
        return type == "SCALAR" ? 1 : type == "VEC2" ? 2 : type == "VEC3" ? 3 : type == "MAT4" ? 16 : 4;
    }

    long double one(std::size_t at, int component, bool normalised) const {
        const auto read = [&](auto number) {
            std::memcpy(&number, &buffer_[at], sizeof(number));
            return static_cast<long double>(number);
        };
        switch (component) {
            case 5120:
                return normalised ? std::max(read(std::int8_t{}) / 127, -1.0L) : read(std::int8_t{});
            case 5121:
                return normalised ? read(std::uint8_t{}) / 255 : read(std::uint8_t{});
            case 5122:
                return normalised ? std::max(read(std::int16_t{}) / 32767, -1.0L) : read(std::int16_t{});
            case 5123:
                return normalised ? read(std::uint16_t{}) / 65535 : read(std::uint16_t{});
            case 5125:
                return read(std::uint32_t{});
            default:
                return read(float{});
        }
    }
    static std::size_t bytesOf(int component) { return component < 5122 ? 1 : component < 5124 ? 2 : 4; }

    std::vector<long double> numbers(const Json& index) const {
        const Json& accessor = file_["accessors"][index.get<std::size_t>()];
        const std::size_t width = widthOf(accessor["type"]), count = accessor["count"];
        const int component = accessor["componentType"];
        const bool normalised = accessor.value("normalized", false);
        std::vector<long double> out(width * count, 0.0L);
        if (accessor.contains("bufferView")) {
            const Json& view = file_["bufferViews"][accessor["bufferView"].get<std::size_t>()];
            const std::size_t from = view.value("byteOffset", 0u) + accessor.value("byteOffset", 0u),
                              stride = view.value("byteStride", width * bytesOf(component));
            for (std::size_t i = 0; i < count; ++i)
                for (std::size_t c = 0; c < width; ++c)
                    out[i * width + c] = one(from + i * stride + c * bytesOf(component), component, normalised);
        }
        if (!accessor.contains("sparse")) return out;
        const Json &sparse = accessor["sparse"], &indices = sparse["indices"], &values = sparse["values"];
        const std::size_t at = file_["bufferViews"][indices["bufferView"].get<std::size_t>()].value("byteOffset", 0u) +
                               indices.value("byteOffset", 0u);
        const std::size_t valuesAt =
            file_["bufferViews"][values["bufferView"].get<std::size_t>()].value("byteOffset", 0u) +
            values.value("byteOffset", 0u);
        for (std::size_t i = 0; i < sparse["count"].get<std::size_t>(); ++i) {
            const auto element = static_cast<std::size_t>(
                one(at + i * bytesOf(indices["componentType"]), indices["componentType"], false));
            for (std::size_t c = 0; c < width; ++c)
                out[element * width + c] = one(valuesAt + (i * width + c) * bytesOf(component), component, normalised);
        }
        return out;
    }

    void play(const Json& animation, long double seconds) {
        for (const Json& channel : animation["channels"]) {
            const Json& sampler = animation["samplers"][channel["sampler"].get<std::size_t>()];
            const std::vector<long double> times = numbers(sampler["input"]), values = numbers(sampler["output"]);
            const std::string kind = sampler.value("interpolation", "LINEAR"), path = channel["target"]["path"];
            const std::size_t parts = kind == "CUBICSPLINE" ? 3 : 1, width = values.size() / times.size() / parts;
            std::size_t k = 0;
            while (k + 1 < times.size() && times[k + 1] <= seconds) ++k;
            const auto v = [&](std::size_t key, std::size_t part, std::size_t c) {
                return values[(key * parts + part) * width + c];
            };
            std::vector<long double> out(width);
            const bool hold = k + 1 == times.size() || seconds < times[0] || kind == "STEP";
            const long double td = hold ? 1 : times[k + 1] - times[k], t = hold ? 0 : (seconds - times[k]) / td;
            for (std::size_t c = 0; c < width; ++c) {
                if (hold)
                    out[c] = v(k, parts == 3 ? 1 : 0, c);
                else if (parts == 3)
                    out[c] = (2 * t * t * t - 3 * t * t + 1) * v(k, 1, c) +
                             td * (t * t * t - 2 * t * t + t) * v(k, 2, c) +
                             (-2 * t * t * t + 3 * t * t) * v(k + 1, 1, c) + td * (t * t * t - t * t) * v(k + 1, 0, c);
                else
                    out[c] = v(k, 0, c) * (1 - t) + v(k + 1, 0, c) * t;
            }
            if (path == "rotation" && !hold && parts == 1) {
                long double dot = 0;
                for (std::size_t c = 0; c < 4; ++c) dot += v(k, 0, c) * v(k + 1, 0, c);
                const long double angle = std::acos(std::min(1.0L, std::abs(dot)));
                for (std::size_t c = 0; c < 4 && angle > 1e-6L; ++c)
                    out[c] = (std::sin((1 - t) * angle) * v(k, 0, c) +
                              (dot < 0 ? -1 : 1) * std::sin(t * angle) * v(k + 1, 0, c)) /
                             std::sin(angle);
            }
            Json said = Json::array();
            for (const long double number : out) said.push_back(static_cast<double>(number));
            nodes_[channel["target"]["node"].get<std::size_t>()][path] = said;
        }
    }

    static Wide4 localOf(const Json& node) {
        Wide4 m = Wide4::Identity();
        if (node.contains("matrix")) {
            for (int i = 0; i < 16; ++i) m(i % 4, i / 4) = node["matrix"][static_cast<std::size_t>(i)].get<double>();
            return m;
        }
        const auto get = [&](const char* name, std::vector<double> otherwise) { return node.value(name, otherwise); };
        const std::vector<double> t = get("translation", {0, 0, 0}), s = get("scale", {1, 1, 1}),
                                  r = get("rotation", {0, 0, 0, 1});
        const Eigen::Quaternion<long double> q = Eigen::Quaternion<long double>(r[3], r[0], r[1], r[2]).normalized();
        m.topLeftCorner<3, 3>() = q.toRotationMatrix();
        for (int c = 0; c < 3; ++c) {
            m.col(c) *= static_cast<long double>(s[static_cast<std::size_t>(c)]);
            m(c, 3) = static_cast<long double>(t[static_cast<std::size_t>(c)]);
        }
        return m;
    }
    void place(std::size_t index, const Wide4& above) {
        const Wide4 world = above * localOf(nodes_[index]);
        worlds_[index] = world;
        for (const Json& child : nodes_[index].value("children", Json::array())) place(child, world);
    }

    void collect(std::size_t index, std::vector<Wide3>& all) {
        const Json& node = nodes_[index];
        if (node.contains("mesh")) {
            const Json& mesh = file_["meshes"][node["mesh"].get<std::size_t>()];
            for (const Json& primitive : mesh["primitives"]) {
                std::vector<long double> p = numbers(primitive["attributes"]["POSITION"]);
                const std::vector<double> weights = node.value("weights", mesh.value("weights", std::vector<double>()));
                for (std::size_t t = 0; t < weights.size() && primitive.contains("targets"); ++t) {
                    if (!primitive["targets"][t].contains("POSITION")) continue;
                    const std::vector<long double> delta = numbers(primitive["targets"][t]["POSITION"]);
                    for (std::size_t i = 0; i < p.size(); ++i) p[i] += static_cast<long double>(weights[t]) * delta[i];
                }
                std::vector<long double> joints, shares, binds;
                if (node.contains("skin")) {
                    joints = numbers(primitive["attributes"]["JOINTS_0"]),
                    shares = numbers(primitive["attributes"]["WEIGHTS_0"]);
                    const Json& skin = file_["skins"][node["skin"].get<std::size_t>()];
                    if (skin.contains("inverseBindMatrices")) binds = numbers(skin["inverseBindMatrices"]);
                }
                for (std::size_t v = 0; v < p.size() / 3; ++v) {
                    const Eigen::Matrix<long double, 4, 1> at(p[3 * v], p[3 * v + 1], p[3 * v + 2], 1);
                    if (joints.empty()) {
                        all.emplace_back((worlds_.at(index) * at).head<3>());
                        continue;
                    }
                    Wide4 m = Wide4::Zero();
                    long double sum = 0;
                    for (std::size_t k = 4 * v; k < 4 * v + 4; ++k) {
                        if (shares[k] == 0) continue;
                        const auto joint = static_cast<std::size_t>(joints[k]);
                        Wide4 bind = Wide4::Identity();
                        for (int i = 0; i < 16 && !binds.empty(); ++i)
                            bind(i % 4, i / 4) = binds[16 * joint + static_cast<std::size_t>(i)];
                        m += shares[k] *
                             worlds_.at(
                                 file_["skins"][node["skin"].get<std::size_t>()]["joints"][joint].get<std::size_t>()) *
                             bind;
                        sum += shares[k];
                    }
                    all.emplace_back((m / sum * at).head<3>());
                }
            }
        }
        for (const Json& child : node.value("children", Json::array())) collect(child, all);
    }

    Json file_, nodes_;
    std::string buffer_;
    std::map<std::size_t, Wide4> worlds_;
};

/// What Tessera's scene shows, in the same order.
std::vector<Vec3d> shownPositions(const Aspect& scene) {
    std::vector<Vec3d> all;
    Action action;
    action.onNode([&](const Visit& visit) {
        if (const Drawable drawable = drawableOf(scene, visit.node)) {
            const MeshArrays arrays = drawable.arrays();
            const auto p = arrays.positions.as<float>();
            for (std::size_t i = 0; i + 2 < p.size(); i += 3)
                all.emplace_back(visit.world_T_node * Vec3d(p[i], p[i + 1], p[i + 2]));
        }
        return Descend::kInto;
    });
    action.run(scene);
    return all;
}

std::string modelsFolder() {
    const char* set = std::getenv("TESSERA_TEST_DATA");
    return set ? set : std::string(TESSERA_SOURCE_DIR) + "/../shared/data";
}

struct Character {
    std::string file;
    std::size_t skins;
};

void expectAsTheFileSays(const std::string& path, std::size_t skins) {
    SCOPED_TRACE(path);
    ImportOptions options;
    options.importerProgram = std::string(TESSERA_BIN_DIR) + "/tessera-import";
    Expected<ImportedScene> imported = importScene(path, kRootNode, options);
    ASSERT_TRUE(imported) << imported.error().message;
    Simulation simulation;
    const Expected<CommittedFrame> loaded = simulation.load({std::move(imported->list)});
    ASSERT_TRUE(loaded) << loaded.error().message;
    FileEvaluator file(path);
    std::size_t found = 0, moved = 0;
    for (const ObjectId id : simulation.scene().ids()) found += simulation.scene().get<Skin>(id) != nullptr;
    EXPECT_EQ(found, skins);
    const double length = static_cast<double>(file.length());
    const int frames =
        std::min(90, static_cast<int>(std::ceil(length * 60)) - 1);  // at its very end a loop begins again
    std::vector<Wide3> first;
    for (int frame = 0; frame <= frames; ++frame) {
        const FrameResult result = simulation.step(frame == 0, {});
        EXPECT_TRUE(result.remarks.empty());
        if (frame % 15 != 0 && frame != 1) continue;
        const std::vector<Wide3> right = file.positionsAt(frame / 60.0L);
        const std::vector<Vec3d> shown = shownPositions(simulation.scene());
        ASSERT_EQ(shown.size(), right.size());
        if (first.empty()) first = right;
        long double size = 0, off = 0;
        for (std::size_t i = 0; i < right.size(); ++i) {
            size = std::max(size, right[i].norm());
            off = std::max(off, (shown[i].cast<long double>() - right[i]).norm());
            moved += (right[i] - first[i]).norm() > 1e-3L;
        }
        // Floats in the file's inverse binds, in `pose` and in the vertices: some 2^-24 of the coordinates each, with
        // the joints' own lengths in between.
        ASSERT_LT(off, 1e-5L * std::max(size, 1e-3L)) << "frame " << frame;
    }
    EXPECT_GT(moved, 0u) << "or nothing was played";
}

/// Joints that turn, step, go along curves; targets of a mesh (tests/data/models/make-models.py).
TEST(GltfCharacters, AreWhereAFileOfOursSaysInEveryFrame) {
    expectAsTheFileSays(TESSERA_SOURCE_DIR "/tests/data/models/arm.glb", 2);
}

TEST(GltfCharacters, AreWhereTheirFilesSayInEveryFrame) {
    const std::string folder = modelsFolder() + "/gltf";
    if (!std::filesystem::exists(folder))
        GTEST_SKIP() << "no folder of real models (TESSERA_TEST_DATA, or shared/data beside the project)";
    for (const auto& [file, skins] : {Character{"BoxAnimated.glb", 0},
                                      {"RiggedSimple.glb", 1},
                                      {"RiggedFigure.glb", 1},
                                      {"Fox.glb", 1},
                                      {"AnimatedMorphCube.glb", 1}})
        expectAsTheFileSays(folder + "/" + file, skins);
}

}  // namespace
}  // namespace tessera

// What a change costs beside copying it: 10,000 and 100,000 moved transforms (translation, rotation and scale in
// double), encoded, decoded and applied, each next to a memcpy of the same ids and values in the same run. With 100,000
// the objects no longer fit into a common last-level cache, while the copied values still do.
//
//     bench_change [--json FILE]
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "common/codec/ChangeCodec.h"
#include "common/cores/Transform.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "tests/bench/PlainCopy.h"

namespace tessera {
namespace {

constexpr int kRounds = 31;

struct Case {
    std::string name;
    double ours = 0, theirs = 0;  ///< ns of processor time per transform, median of the rounds
};

ChangeList creations(std::uint64_t count) {
    ChangeListBuilder builder;
    for (std::uint64_t i = 0; i < count; ++i) builder.create(ObjectId(2 + i), typeOf<Transform>());
    return builder.take();
}

ChangeList moves(std::uint64_t count, int frame) {
    ChangeListBuilder builder;
    for (std::uint64_t i = 0; i < count; ++i) {
        const double t = 0.001 * double(i) + frame;
        builder.set(ObjectId(2 + i), typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(t, -t, 0.5)));
        builder.set(ObjectId(2 + i), typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(Quatd(1, t, 0, 0)));
        builder.set(ObjectId(2 + i), typeOf<Transform>(), fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1)));
    }
    return builder.take();
}

/// Processor time of this thread: what others do on the machine meanwhile does not count, short of the caches they
/// take.
double nanoseconds(const std::function<void()>& work) {
    const auto now = [] {
        timespec time{};
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
        return double(time.tv_sec) * 1e9 + double(time.tv_nsec);
    };
    const double start = now();
    work();
    return now() - start;
}

double median(std::vector<double> times) {
    std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
    return times[times.size() / 2];
}

void must(bool done) {
    TESSERA_CHECK(done, "a list of the benchmark was refused");
}

void measure(std::uint64_t count, std::vector<Case>& cases) {
    const ChangeList lists[] = {moves(count, 1), moves(count, 2)};
    PlainCopy copy(lists[0]);
    const BlobStore store;
    Aspect aspect;
    must(aspect.apply(creations(count)).has_value());
    const Bytes encoded = encodeChangeList(lists[0]);
    int turn = 0;
    // Ours and the copy take turns, so that a busy machine slows both.
    const auto compare = [&](std::string_view name, const std::function<void()>& ours) {
        std::vector<double> our, their;
        for (int round = 0; round < kRounds; ++round) {
            our.push_back(nanoseconds(ours) / double(count));
            their.push_back(nanoseconds([&] { copy(); }) / double(count));
        }
        cases.push_back({fmt::format("{} {}", name, count), median(our), median(their)});
    };
    compare("encode", [&] { must(!encodeChangeList(lists[0]).empty()); });
    compare("decode", [&] { must(decodeChangeList(encoded, store).has_value()); });
    compare("apply", [&] { must(aspect.apply(lists[turn++ & 1]).has_value()); });
    compare("apply with inverse", [&] { must(aspect.applyWithInverse(lists[turn++ & 1]).has_value()); });
}

std::string json(const std::vector<Case>& cases) {
    std::string entries;
    for (const Case& c : cases)
        entries += fmt::format(
            "{}\n  {{\"case\": \"{}\", \"peer\": \"memcpy\", \"ours\": {:.17g}, \"theirs\": {:.17g}, "
            "\"unit\": \"ns per transform\", \"ratio\": {:.17g}}}",
            entries.empty() ? "" : ",", c.name, c.ours, c.theirs, c.ours / c.theirs);
    return "{\"cases\": [" + entries + "\n]}\n";
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    if (!arguments.empty() && (arguments.size() != 2 || arguments[0] != "--json")) {
        std::fprintf(stderr, "usage: bench_change [--json FILE]\n");
        return 2;
    }
    std::vector<tessera::Case> cases;
    for (const std::uint64_t count : {10'000, 100'000}) tessera::measure(count, cases);
    std::printf("%-26s %14s %14s %8s\n", "", "ns/transform", "memcpy", "ratio");
    for (const tessera::Case& c : cases)
        std::printf("%-26s %14.1f %14.1f %8.1f\n", c.name.c_str(), c.ours, c.theirs, c.ours / c.theirs);
    if (arguments.empty()) return 0;
    std::FILE* file = std::fopen(arguments[1].c_str(), "w");
    const std::string text = tessera::json(cases);
    if (!file || std::fwrite(text.data(), 1, text.size(), file) != text.size() || std::fclose(file) != 0) {
        std::fprintf(stderr, "bench_change: %s cannot be written\n", arguments[1].c_str());
        return 1;
    }
    return 0;
}

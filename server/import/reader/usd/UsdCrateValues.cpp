#include "server/import/reader/usd/UsdCrateValues.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace tessera {
namespace {

constexpr int kDeepestDictionary = 32;
/// Arrays of fewer elements are never pressed together.
constexpr std::uint64_t kFewestPacked = 16;

enum class Disk : std::uint8_t { kNone, kByte, kInt, kUnsigned, kInt64, kUnsigned64, kHalf, kFloat, kDouble, kWord };

/// How a type's values stand in the file.
struct CrateType {
    Disk disk = Disk::kNone;
    unsigned width = 1;
};

/// The numbers of types, as published.
constexpr std::array<CrateType, 31> kTypes = {
    CrateType{},         {Disk::kByte},       {Disk::kByte},      {Disk::kInt},       {Disk::kUnsigned},
    {Disk::kInt64},      {Disk::kUnsigned64}, {Disk::kHalf},      {Disk::kFloat},     {Disk::kDouble},
    {Disk::kWord},       {Disk::kWord},       {Disk::kWord},      {Disk::kDouble, 4}, {Disk::kDouble, 9},
    {Disk::kDouble, 16}, {Disk::kDouble, 4},  {Disk::kFloat, 4},  {Disk::kHalf, 4},   {Disk::kDouble, 2},
    {Disk::kFloat, 2},   {Disk::kHalf, 2},    {Disk::kInt, 2},    {Disk::kDouble, 3}, {Disk::kFloat, 3},
    {Disk::kHalf, 3},    {Disk::kInt, 3},     {Disk::kDouble, 4}, {Disk::kFloat, 4},  {Disk::kHalf, 4},
    {Disk::kInt, 4}};
constexpr unsigned kString = 10, kMatrix2d = 13, kMatrix4d = 15, kVec2h = 21, kDictionary = 31, kPathVector = 40,
                   kTokenVector = 41, kVariability = 44, kDoubleVector = 48, kStringVector = 50, kValue = 52,
                   kTimeCode = 56, kAnimationBlock = 60;

CrateType typeOf(unsigned type) {
    if (type == kTimeCode) return {Disk::kDouble};
    return type < kTypes.size() ? kTypes[type] : CrateType{};
}

unsigned bytesOf(Disk disk) {
    switch (disk) {
        case Disk::kByte:
            return 1;
        case Disk::kHalf:
            return 2;
        case Disk::kInt64:
        case Disk::kUnsigned64:
        case Disk::kDouble:
            return 8;
        default:
            return 4;
    }
}

template <typename To, typename From>
std::vector<To> numbersIn(ByteSpan bytes) {
    std::vector<To> out(bytes.size() / sizeof(From));
    if constexpr (std::is_same_v<To, From>) {
        if (!out.empty()) std::memcpy(out.data(), bytes.data(), bytes.size());
    } else {
        for (std::size_t i = 0; i < out.size(); ++i) {
            From number{};
            std::memcpy(&number, bytes.data() + i * sizeof(From), sizeof(From));
            out[i] = static_cast<To>(number);
        }
    }
    return out;
}

std::vector<float> halvesIn(ByteSpan bytes) {
    const std::vector<std::uint16_t> halves = numbersIn<std::uint16_t, std::uint16_t>(bytes);
    std::vector<float> out(halves.size());
    std::ranges::transform(halves, out.begin(), floatOfHalf);
    return out;
}

void setNumbers(UsdValue& value, Disk disk, ByteSpan bytes) {
    switch (disk) {
        case Disk::kByte:
            value.data = numbersIn<std::int32_t, std::uint8_t>(bytes);
            break;
        case Disk::kInt:
            value.data = numbersIn<std::int32_t, std::int32_t>(bytes);
            break;
        case Disk::kUnsigned:
            value.data = numbersIn<double, std::uint32_t>(bytes);
            break;
        case Disk::kInt64:
            value.data = numbersIn<double, std::int64_t>(bytes);
            break;
        case Disk::kUnsigned64:
            value.data = numbersIn<double, std::uint64_t>(bytes);
            break;
        case Disk::kHalf:
            value.data = halvesIn(bytes);
            break;
        case Disk::kFloat:
            value.data = numbersIn<float, float>(bytes);
            break;
        default:
            value.data = numbersIn<double, double>(bytes);
    }
}

UsdValue nothingOfIt() {
    UsdValue value;
    value.data = std::make_shared<const UsdValue::Dictionary>();
    return value;
}

}  // namespace

tl::unexpected<Error> UsdCrateValues::damaged(UsdCrateRep rep) const {
    return fail(ErrorCode::kBadInput,
                fmt::format("it is cut off or damaged: a value of type {} at byte {} of {} is not whole", rep.type(),
                            rep.payload(), bytes_.size()));
}

Expected<void> UsdCrateValues::spend(std::uint64_t bytes) {
    if (bytes > budget_) return fail(ErrorCode::kLimit, "its values unpack to far more bytes than a file of its size");
    budget_ -= bytes;
    return {};
}

const std::string& UsdCrateValues::token(std::uint64_t index) const {
    static const std::string kNone;
    return index < tables_.tokens.size() ? tables_.tokens[index] : kNone;
}

std::string UsdCrateValues::string(std::uint64_t index) const {
    return index < tables_.strings.size() ? token(tables_.strings[index]) : std::string();
}

std::string UsdCrateValues::path(std::uint64_t index) {
    std::vector<const UsdCrateTables::Path*> parts;
    for (; index < tables_.paths.size() && tables_.paths[index].known && tables_.paths[index].depth > 0;
         index = tables_.paths[index].parent)
        parts.push_back(&tables_.paths[index]);
    if (index >= tables_.paths.size()) return {};
    std::string text;
    for (auto part = parts.rbegin(); part != parts.rend(); ++part)
        if (!(*part)->name.starts_with('{')) text += ((*part)->isProperty ? "." : "/") + (*part)->name;
    return text.empty() ? "/" : text;
}

// ---- single values --------------------------------------------------------------------------------------------------

Expected<UsdValue> UsdCrateValues::inlined(UsdCrateRep rep) {
    UsdValue value;
    const auto bits = static_cast<std::uint32_t>(rep.payload());
    const CrateType type = typeOf(rep.type());
    if (rep.type() == kValueBlock || rep.type() == kAnimationBlock) return value;
    if (rep.type() >= kSpecifier && rep.type() <= kVariability) {
        value.data = std::vector<std::int32_t>{static_cast<std::int32_t>(bits)};
        return value;
    }
    if (type.disk == Disk::kNone) return nothingOfIt();
    if (type.disk == Disk::kWord) {
        value.data = UsdValue::Words{rep.type() == kString ? string(bits) : token(bits)};
        return value;
    }
    value.width = type.width;
    const auto signedByte = [&](unsigned i) { return static_cast<std::int8_t>(i < 4 ? bits >> (8 * i) & 0xff : 0); };
    if (rep.type() >= kMatrix2d && rep.type() <= kMatrix4d) {
        // The diagonal; all else is 0.
        const unsigned rows = rep.type() - kMatrix2d + 2;
        std::vector<double> matrix(type.width);
        for (unsigned i = 0; i < rows; ++i) matrix[static_cast<std::size_t>(i) * rows + i] = signedByte(i);
        value.data = std::move(matrix);
    } else if (type.width > 1 && rep.type() != kVec2h) {
        std::vector<float> numbers(type.width);
        for (unsigned i = 0; i < type.width; ++i) numbers[i] = signedByte(i);
        value.data = std::move(numbers);
    } else {
        switch (type.disk) {
            case Disk::kDouble:
                value.data = std::vector<double>{std::bit_cast<float>(bits)};
                break;
            case Disk::kInt64:
                value.data = std::vector<double>{static_cast<double>(static_cast<std::int32_t>(bits))};
                break;
            case Disk::kUnsigned64:
                value.data = std::vector<double>{static_cast<double>(bits)};
                break;
            default: {
                const std::array<std::uint32_t, 1> held{bits};
                setNumbers(value, type.disk, std::as_bytes(std::span(held)).first(bytesOf(type.disk) * type.width));
            }
        }
    }
    return value;
}

Expected<UsdValue> UsdCrateValues::dictionary(UsdCrateRep rep, int depth) {
    UsdCrateCursor in(bytes_, rep.payload());
    auto held = std::make_shared<UsdValue::Dictionary>();
    const std::uint64_t count = in.count(12);
    for (std::uint64_t i = 0; i < count && in.good(); ++i) {
        std::string key = string(in.read<std::uint32_t>());
        const std::uint64_t begin = in.at();
        in.seek(begin + in.read<std::uint64_t>());
        const UsdCrateRep inner{in.read<std::uint64_t>()};
        if (!in.good()) break;
        if (Expected<void> spent = spend(64 + key.size()); !spent) return tl::unexpected(spent.error());
        const Expected<UsdValuePtr> value = this->value(inner, depth + 1);
        if (!value) return tl::unexpected(value.error());
        held->insert_or_assign(std::move(key), **value);
    }
    if (!in.good()) return damaged(rep);
    UsdValue value;
    value.data = std::shared_ptr<const UsdValue::Dictionary>(std::move(held));
    return value;
}

Expected<UsdValue> UsdCrateValues::scalar(UsdCrateRep rep, int depth) {
    if (rep.type() == kDictionary) return dictionary(rep, depth);
    UsdCrateCursor in(bytes_, rep.payload());
    if (rep.type() == kValue) {
        const UsdCrateRep inner{in.read<std::uint64_t>()};
        if (!in.good()) return damaged(rep);
        const Expected<UsdValuePtr> value = this->value(inner, depth + 1);
        if (!value) return tl::unexpected(value.error());
        return **value;
    }
    UsdValue value;
    const CrateType type = typeOf(rep.type());
    if (rep.type() == kTokenVector || rep.type() == kStringVector || rep.type() == kPathVector) {
        const std::uint64_t count = in.count(4);
        if (!in.good()) return damaged(rep);
        UsdValue::Words words(count);
        std::uint64_t bytes = 0;
        for (std::string& word : words) {
            const auto index = in.read<std::uint32_t>();
            word = rep.type() == kTokenVector    ? token(index)
                   : rep.type() == kStringVector ? string(index)
                                                 : path(index);
            bytes += sizeof(word) + word.size();
            if (bytes > budget_) break;
        }
        if (Expected<void> spent = spend(bytes); !spent) return tl::unexpected(spent.error());
        value.data = std::move(words);
        value.array = true;
        return value;
    }
    if (rep.type() == kDoubleVector) {
        const ByteSpan numbers = in.take(in.count(8) * 8);
        if (!in.good()) return damaged(rep);
        if (Expected<void> spent = spend(numbers.size()); !spent) return tl::unexpected(spent.error());
        setNumbers(value, Disk::kDouble, numbers);
        value.array = true;
        return value;
    }
    if (type.disk == Disk::kNone) return nothingOfIt();
    if (type.disk == Disk::kWord) {
        const auto index = in.read<std::uint32_t>();
        value.data = UsdValue::Words{rep.type() == kString ? string(index) : token(index)};
    } else {
        setNumbers(value, type.disk, in.take(static_cast<std::uint64_t>(bytesOf(type.disk)) * type.width));
        value.width = type.width;
    }
    if (!in.good()) return damaged(rep);
    return value;
}

// ---- arrays ---------------------------------------------------------------------------------------------------------

Expected<UsdValue> UsdCrateValues::packedArray(UsdCrateRep rep, UsdCrateCursor& in, std::uint64_t count) {
    const CrateType type = typeOf(rep.type());
    UsdValue value;
    value.array = true;
    if (Expected<void> spent = spend(count * bytesOf(type.disk)); !spent) return tl::unexpected(spent.error());
    const auto take = [&](auto numbers, auto* stored) -> bool {
        using Stored = std::remove_pointer_t<decltype(stored)>;
        if (!numbers) return false;
        std::vector<Stored> out(numbers->size());
        std::ranges::transform(*numbers, out.begin(), [](auto n) { return static_cast<Stored>(n); });
        value.data = std::move(out);
        return true;
    };
    bool good = false;
    switch (type.disk) {
        case Disk::kInt:
            good = take(unpackUsdIntegers<std::int32_t>(in, count), static_cast<std::int32_t*>(nullptr));
            break;
        case Disk::kUnsigned:
            good = take(unpackUsdIntegers<std::uint32_t>(in, count), static_cast<double*>(nullptr));
            break;
        case Disk::kInt64:
            good = take(unpackUsdIntegers<std::int64_t>(in, count), static_cast<double*>(nullptr));
            break;
        case Disk::kUnsigned64:
            good = take(unpackUsdIntegers<std::uint64_t>(in, count), static_cast<double*>(nullptr));
            break;
        default: {
            const auto way = in.read<char>();
            if (way == 'i') {
                // Whole numbers, all of them.
                good = type.disk == Disk::kDouble
                           ? take(unpackUsdIntegers<std::int32_t>(in, count), static_cast<double*>(nullptr))
                           : take(unpackUsdIntegers<std::int32_t>(in, count), static_cast<float*>(nullptr));
            } else if (way == 't') {
                UsdValue table;
                const auto entries = in.read<std::uint32_t>();
                setNumbers(table, type.disk, in.take(static_cast<std::uint64_t>(entries) * bytesOf(type.disk)));
                const auto indices = unpackUsdIntegers<std::uint32_t>(in, count);
                good = indices && table.count() == entries &&
                       std::ranges::all_of(*indices, [&](std::uint32_t i) { return i < entries; });
                if (!good) break;
                std::visit(
                    [&](const auto& held) {
                        using Held = std::decay_t<decltype(held)>;
                        if constexpr (std::is_same_v<Held, std::vector<float>> ||
                                      std::is_same_v<Held, std::vector<double>>) {
                            Held out(indices->size());
                            std::ranges::transform(*indices, out.begin(), [&](std::uint32_t i) { return held[i]; });
                            value.data = std::move(out);
                        }
                    },
                    table.data);
            }
        }
    }
    if (!good) return damaged(rep);
    return value;
}

Expected<UsdValue> UsdCrateValues::array(UsdCrateRep rep) {
    const CrateType type = typeOf(rep.type());
    if (type.disk == Disk::kNone) return nothingOfIt();
    UsdValue value;
    value.width = type.width;
    value.array = true;
    if (rep.payload() == 0) {
        if (type.disk == Disk::kWord)
            value.data = UsdValue::Words();
        else
            setNumbers(value, type.disk, {});
        return value;
    }
    UsdCrateCursor in(bytes_, rep.payload());
    if (minor_ < 5) (void)in.read<std::uint32_t>();  // its rank, which is 1
    const std::uint64_t count = minor_ < 7 ? in.read<std::uint32_t>() : in.read<std::uint64_t>();
    if (!in.good()) return damaged(rep);
    const bool scalars = type.width == 1 && type.disk != Disk::kByte && type.disk != Disk::kWord;
    if (rep.isPacked() && scalars && count >= kFewestPacked) {
        // Each number has two bits at least, and a byte becomes 255 at most.
        if (count / 4 / 255 > in.left()) return damaged(rep);
        return packedArray(rep, in, count);
    }
    const std::uint64_t bytesEach = static_cast<std::uint64_t>(bytesOf(type.disk)) * type.width;
    if (count > in.left() / bytesEach) return damaged(rep);
    if (Expected<void> spent = spend(count * bytesEach * (type.disk == Disk::kWord ? 10 : 2)); !spent)
        return tl::unexpected(spent.error());
    if (type.disk != Disk::kWord) {
        setNumbers(value, type.disk, in.take(count * bytesEach));
        return value;
    }
    UsdValue::Words words(count);
    std::uint64_t bytes = 0;
    for (std::string& word : words) {
        const auto index = in.read<std::uint32_t>();
        word = rep.type() == kString ? string(index) : token(index);
        bytes += word.size();
        if (bytes > budget_) break;
    }
    if (Expected<void> spent = spend(bytes); !spent) return tl::unexpected(spent.error());
    value.data = std::move(words);
    return value;
}

Expected<UsdValuePtr> UsdCrateValues::value(UsdCrateRep rep, int depth) {
    if (depth > kDeepestDictionary) return fail(ErrorCode::kLimit, "its dictionaries are nested too deep");
    if (!rep.isInlined())
        if (const auto known = known_.find(rep.bits); known != known_.end()) return known->second;
    Expected<UsdValue> read = rep.isInlined() ? inlined(rep) : rep.isArray() ? array(rep) : scalar(rep, depth);
    if (!read) return tl::unexpected(read.error());
    auto value = std::make_shared<const UsdValue>(std::move(*read));
    if (!rep.isInlined()) known_.emplace(rep.bits, value);
    return value;
}

// ---- what is no value of an attribute -------------------------------------------------------------------------------

Expected<std::vector<std::pair<double, UsdValuePtr>>> UsdCrateValues::samples(UsdCrateRep rep) {
    UsdCrateCursor in(bytes_, rep.payload());
    const std::uint64_t begin = in.at();
    in.seek(begin + in.read<std::uint64_t>());
    const UsdCrateRep timesRep{in.read<std::uint64_t>()};
    const std::uint64_t values = in.at();
    in.seek(values + in.read<std::uint64_t>());
    const std::uint64_t count = in.count(8);
    if (!in.good()) return damaged(rep);
    const Expected<UsdValuePtr> times = value(timesRep);
    if (!times) return tl::unexpected(times.error());
    const std::vector<double> at = (*times)->numbers<double>();
    if (at.size() != count)
        return fail(ErrorCode::kBadInput, fmt::format("{} samples have {} times", count, at.size()));
    if (Expected<void> spent = spend(count * 64); !spent) return tl::unexpected(spent.error());
    std::vector<std::pair<double, UsdValuePtr>> samples;
    for (std::uint64_t i = 0; i < count; ++i) {
        const Expected<UsdValuePtr> value = this->value(UsdCrateRep{in.read<std::uint64_t>()});
        if (!value) return tl::unexpected(value.error());
        if (std::isfinite(at[i])) samples.emplace_back(at[i], *value);
    }
    std::ranges::stable_sort(samples, {}, [](const auto& sample) { return sample.first; });
    return samples;
}

template <typename Item, typename Read>
Expected<UsdListOp<Item>> UsdCrateValues::list(UsdCrateRep rep, std::uint64_t bytesEach, Read&& read) {
    UsdCrateCursor in(bytes_, rep.payload());
    UsdListOp<Item> list;
    const auto bits = in.read<std::uint8_t>();
    list.isExplicit = (bits & 1U) != 0;
    // In the file in this order; their bits are in another.
    const std::pair<unsigned, std::vector<Item>*> parts[] = {{2U, &list.items},      {4U, &list.added},
                                                             {32U, &list.prepended}, {64U, &list.appended},
                                                             {8U, &list.deleted},    {16U, &list.ordered}};
    for (const auto& [bit, to] : parts) {
        if ((bits & bit) == 0) continue;
        const std::uint64_t count = in.count(bytesEach);
        if (Expected<void> spent = spend(count * (sizeof(Item) + 32)); !spent) return tl::unexpected(spent.error());
        for (std::uint64_t i = 0; i < count && in.good(); ++i) to->push_back(read(in));
    }
    if (!in.good()) return damaged(rep);
    return list;
}

Expected<UsdListOp<std::string>> UsdCrateValues::paths(UsdCrateRep rep) {
    return list<std::string>(rep, 4, [&](UsdCrateCursor& in) { return path(in.read<std::uint32_t>()); });
}

Expected<UsdListOp<std::string>> UsdCrateValues::words(UsdCrateRep rep) {
    constexpr unsigned kTokenListOp = 32;
    return list<std::string>(rep, 4, [&](UsdCrateCursor& in) {
        const auto index = in.read<std::uint32_t>();
        return rep.type() == kTokenListOp ? token(index) : string(index);
    });
}

UsdReference UsdCrateValues::reference(UsdCrateCursor& in, bool isPayload) {
    UsdReference reference;
    reference.asset = string(in.read<std::uint32_t>());
    reference.path = path(in.read<std::uint32_t>());
    if (reference.path == "/") reference.path.clear();
    if (!isPayload || minor_ >= 8) {
        reference.time.offset = in.read<double>();
        reference.time.scale = in.read<double>();
        if (!std::isfinite(reference.time.offset) || !std::isfinite(reference.time.scale) || reference.time.scale == 0)
            reference.time = {};
    }
    if (isPayload) return reference;
    // Custom data, of which nothing is shown: to be passed over.
    const std::uint64_t entries = in.count(12);
    for (std::uint64_t i = 0; i < entries && in.good(); ++i) {
        (void)in.read<std::uint32_t>();
        const std::uint64_t begin = in.at();
        in.seek(begin + in.read<std::uint64_t>());
        (void)in.read<std::uint64_t>();
    }
    return reference;
}

Expected<UsdListOp<UsdReference>> UsdCrateValues::references(UsdCrateRep rep) {
    constexpr unsigned kPayloadListOp = 55;
    if (rep.type() == kPayload) {
        UsdCrateCursor in(bytes_, rep.payload());
        UsdListOp<UsdReference> one;
        one.isExplicit = true;
        one.items.push_back(reference(in, true));
        if (!in.good()) return damaged(rep);
        return one;
    }
    const bool isPayload = rep.type() == kPayloadListOp;
    return list<UsdReference>(rep, 8, [&](UsdCrateCursor& in) { return reference(in, isPayload); });
}

Expected<std::map<std::string, std::string>> UsdCrateValues::selections(UsdCrateRep rep) {
    UsdCrateCursor in(bytes_, rep.payload());
    std::map<std::string, std::string> selections;
    const std::uint64_t count = in.count(8);
    for (std::uint64_t i = 0; i < count; ++i) {
        std::string set = string(in.read<std::uint32_t>());
        selections[std::move(set)] = string(in.read<std::uint32_t>());
    }
    if (!in.good()) return damaged(rep);
    return selections;
}

Expected<std::vector<UsdTime>> UsdCrateValues::times(UsdCrateRep rep) {
    UsdCrateCursor in(bytes_, rep.payload());
    std::vector<UsdTime> times(in.count(16));
    for (UsdTime& time : times) {
        time.offset = in.read<double>();
        time.scale = in.read<double>();
        if (!std::isfinite(time.offset) || !std::isfinite(time.scale) || time.scale == 0) time = {};
    }
    if (!in.good()) return damaged(rep);
    return times;
}

}  // namespace tessera

/// The inner loops of neighbour finding, compiled for each instruction set. Plain data only: what is shared with other
/// translation units must not be compiled with wider instructions than the processor may have.
///
/// **Keys.** A box is worked on as six floats, its bounds less an origin, each rounded to the nearest float; the lower
/// ones negated, so that two boxes overlap where all six sums "upper of one + negated lower of the other" are not
/// negative. Rounding is monotone, so bounds in double x ≤ y have keys in that order too, and keys x < y say that the
/// bounds are in that order: only sums of zero leave a question, which the caller answers in double. Keys are clamped
/// to ±kFar (monotone as well), so that sums are finite. All six keys of an empty box are -kNowhere.
///
/// **Slots.** Boxes are kept in an order in which neighbours in space lie side by side (`cells` of a grid, leaves of a
/// tree), in blocks of sixteen, with the keys of now (`cur`) and of the frame before (`prev`). What the kernels find is
/// *differences*: pairs that met then and do not now, or the other way about. With nothing in `prev`, that is all
/// pairs. All arrays may be read up to kSlotPadding slots beyond their end, where boxes must be empty.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {
enum class InstructionSet : std::uint8_t;
}

namespace tessera::neighbours {

constexpr float kFar = 1e38F;
constexpr float kNowhere = 3e38F;
constexpr std::size_t kSlotPadding = 32;
constexpr std::size_t kBlockSlots = 16;  ///< slots of a block or leaf, children of a node
constexpr std::size_t kBlockFloats = 6 * kBlockSlots;

/// Where the key of a bound (negated lower x, y, z, upper x, y, z) of a slot lies.
constexpr std::size_t keyIndex(std::size_t bound, std::size_t slot) {
    return slot / kBlockSlots * kBlockFloats + bound * kBlockSlots + slot % kBlockSlots;
}
/// Likewise for three numbers per slot.
constexpr std::size_t placeIndex(std::size_t axis, std::size_t slot) {
    return slot / kBlockSlots * (3 * kBlockSlots) + axis * kBlockSlots + slot % kBlockSlots;
}

/// Two slots whose boxes (surely, or perhaps) met then and do not now, or the other way about.
struct SlotPair {
    static constexpr std::uint32_t kUnsure = 1U << 31;  ///< a sum of zero: to be decided in double
    static constexpr std::uint32_t kBegins = 1U << 30;
    static constexpr std::uint32_t kSlotMask = kBegins - 1;
    std::uint32_t first;
    std::uint32_t secondAndFlags;
};

/// Where a kernel puts its pairs. One that finds no room stops and says how far it came.
struct PairSink {
    SlotPair* out;
    std::size_t capacity;
    std::size_t count;
};

/// By keyIndex.
struct SlotArrays {
    const float* cur;
    const float* prev;
};

/// Cells over the lower corners, as they were when the slots were put in order: cell of v along an axis = (v - origin)
/// * scale, clamped to 0 … last. The first axis is the one along which cells lie side by side; a column is a row of
/// them.
struct CellFrame {
    int axis[3];  ///< of the world
    float origin[3];
    float scale[3];
    float last[3];
    std::uint32_t xBits;  ///< log2 of the cells in a column
    std::uint32_t ny;     ///< columns lie side by side along the second axis
};

struct GridView {
    SlotArrays slots;
    CellFrame frame;
    const std::uint32_t* cell;   ///< per slot of the grid: column << xBits | cell in the column; ascending
    const std::uint32_t* start;  ///< first slot of each cell; at the end the number of slots in the grid
    std::uint32_t looseBegin;    ///< slots outside of all cells: outsized boxes, and what leapt
    std::uint32_t looseEnd;
    float reach[3];  ///< how far below a box the cell of a box that meets it may be: extent and drift
    float drift[3];  ///< how far above
};

/// Boxes (of now and before) around blocks of slots, around sixteen of these, and so on up to one.
struct TreeView {
    static constexpr int kMaxLevels = 8;
    SlotArrays slots;
    int levels;
    float* box[kMaxLevels];  ///< per level, from the leaves up, by keyIndex; what is no node is empty
    std::uint32_t nodes[kMaxLevels];
};

/// What has happened to slots since they were put in order.
struct Settlement {
    float maxDrift[3];   ///< in: what a slot may drift to stay; out: how far those that stay have drifted
    float maxExtent[3];  ///< in: how large a box may be to stay
};

struct SlotKernels {
    /// Keys of n boxes (six doubles each) into records of 8 floats (negated lower, 0, upper, 0); record slotOf[i], none
    /// for ~0.
    void (*convert)(const double* boxes, const std::uint32_t* slotOf, std::size_t n, const double origin[3],
                    float* records);
    /// Records to keys, for slots begin (a multiple of 16) up to end.
    void (*spread)(const float* records, std::size_t begin, std::size_t end, float* cur);
    /// Lists the slots (from a multiple of 16 on) that do not stay, and says how many. `placed`, by placeIndex: the
    /// negated lower bounds when the order was made.
    std::size_t (*settle)(const float* cur, const float* placed, std::size_t begin, std::size_t end,
                          Settlement& settlement, std::uint32_t* leavers);
    void (*cells)(const CellFrame& frame, const float* cur, std::size_t n, std::uint32_t* cell);

    /// Each pair of grid slots once, for the first slots begin … end - 1. Returns how far it came.
    std::size_t (*gridAll)(const GridView& grid, std::size_t begin, std::size_t end, PairSink& sink);
    /// Each of the listed slots against the whole grid and, where `loose`, against all loose slots, else against the
    /// loose ones after it. May report a slot with itself.
    std::size_t (*gridSome)(const GridView& grid, const std::uint32_t* slots, std::size_t begin, std::size_t end,
                            bool loose, PairSink& sink);

    void (*treeLeaves)(const TreeView& tree, std::size_t begin, std::size_t end);
    void (*treeUpper)(const TreeView& tree);
    /// Each pair of slots once, for the first slot in leaves begin … end - 1.
    std::size_t (*treeAll)(const TreeView& tree, std::size_t begin, std::size_t end, PairSink& sink);
    /// Each of the listed slots against all. May report a slot with itself.
    std::size_t (*treeSome)(const TreeView& tree, const std::uint32_t* slots, std::size_t begin, std::size_t end,
                            PairSink& sink);
};

/// Those for an instruction set, which the processor must have; and the best ones it has. All find the same.
[[nodiscard]] const SlotKernels& slotKernels(InstructionSet set);
[[nodiscard]] const SlotKernels& slotKernels();

}  // namespace tessera::neighbours

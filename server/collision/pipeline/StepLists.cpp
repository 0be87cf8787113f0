#include "server/collision/pipeline/StepLists.h"

namespace tessera {
namespace {

template <typename Items, typename Make>
std::shared_ptr<Items> heldOrNew(std::weak_ptr<Items>& known, std::size_t size, const Make& make) {
    std::shared_ptr<Items> items = known.lock();
    if (!items) known = items = std::make_shared<Items>(Items{size, make, {}});
    return items;
}

}  // namespace

void StepLists::give(const ContactList::Page& contacts, const EventBook::Page& events, const Makers& makers,
                     StepResult& result) {
    result.contacts = LazyList<Contact>(heldOrNew(contacts_, contacts.size, makers.contacts));
    result.events = PhaseList<PairEvent>(heldOrNew(events_, events.events, makers.events), events.eventChanges);
    result.distances =
        DistanceList(heldOrNew(distances_, events.distances, makers.distances), events.distanceChanges, events.near);
}

void StepLists::close() {
    makeContacts();
    if (const auto late = events_.lock()) late->makeNow();
    if (const auto late = distances_.lock()) late->makeNow();
    contacts_.reset();
    events_.reset();
    distances_.reset();
}

void StepLists::forget() {
    if (const auto late = contacts_.lock()) late->forget();
    if (const auto late = events_.lock()) late->forget();
    if (const auto late = distances_.lock()) late->forget();
    contacts_.reset();
    events_.reset();
    distances_.reset();
}

}  // namespace tessera

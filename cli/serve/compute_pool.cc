#include "cli/serve/compute_pool.h"

namespace scarp {

ComputePool::ComputePool(const Limits& limits) : limits_(limits) {
  for (int i = 0; i < limits.threads; ++i) threads_.emplace_back([this] { work(); });
}

ComputePool::~ComputePool() {
  close();
  for (std::thread& thread : threads_) thread.join();
}

bool ComputePool::submit(PoolTask task) {
  {
    const std::scoped_lock lock(mutex_);
    const auto own = queues_.find(task.client);
    const std::size_t of_client = own == queues_.end() ? 0 : own->second.size();
    if (closed_ || counts_.waiting >= limits_.waiting || of_client >= limits_.waiting_of_client) {
      ++counts_.refused;
      return false;
    }
    if (of_client == 0) turns_.push_back(task.client);
    ++counts_.waiting;
    std::deque<PoolTask>& queue = queues_[task.client];
    queue.push_back(std::move(task));
  }
  changed_.notify_one();
  return true;
}

void ComputePool::close() {
  std::map<std::string, std::deque<PoolTask>> left;
  {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
    left.swap(queues_);
    turns_.clear();
    counts_.waiting = 0;
  }
  changed_.notify_all();
  for (auto& [client, queue] : left)
    for (PoolTask& task : queue) task.refuse(PoolTask::Why::kClosing);
}

ComputePool::Counts ComputePool::counts() const {
  const std::scoped_lock lock(mutex_);
  return counts_;
}

void ComputePool::work() {
  for (;;) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || !turns_.empty(); });
    if (turns_.empty()) return;
    const std::string client = turns_.front();
    turns_.pop_front();
    const auto queue = queues_.find(client);
    const PoolTask task = std::move(queue->second.front());
    queue->second.pop_front();
    if (queue->second.empty())
      queues_.erase(queue);
    else
      turns_.push_back(client);
    --counts_.waiting;
    ++counts_.running;
    lock.unlock();
    if (task.is_not_wanted && task.is_not_wanted())
      task.refuse(PoolTask::Why::kNotWanted);
    else
      task.run();
    lock.lock();
    --counts_.running;
    ++counts_.done;
  }
}

}  // namespace scarp

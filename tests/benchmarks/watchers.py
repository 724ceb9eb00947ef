"""Many who only watch: websocket clients that take whatever the dashboard sends, ``python -m ... PORT COUNT``.

They are no browsers: twenty Chromiums on two cores would measure themselves. A line on standard output says when all
are up to date; they stay until they are stopped.
"""

import asyncio
import sys

import viser
import websockets

QUIET_S = 1.0


async def watch(port: int, ready: asyncio.Semaphore) -> None:
    """Take messages for ever; release ``ready`` once nothing comes for a while."""
    protocol = websockets.Subprotocol(f"viser-v{viser.__version__}")
    address = f"ws://127.0.0.1:{port}"
    async with websockets.connect(address, subprotocols=[protocol], compression=None, max_size=None) as socket:
        while True:
            try:
                await asyncio.wait_for(socket.recv(), QUIET_S)
            except TimeoutError:
                break
        ready.release()
        async for _ in socket:
            pass


async def main(port: int, count: int) -> None:
    """So many watchers."""
    ready = asyncio.Semaphore(0)
    tasks = [asyncio.create_task(watch(port, ready)) for _ in range(count)]
    for _ in tasks:
        await ready.acquire()
    print("watching", flush=True)
    await asyncio.gather(*tasks)


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]), int(sys.argv[2])))

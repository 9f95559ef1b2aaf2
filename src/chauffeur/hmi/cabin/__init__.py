"""The cabin page: what a passenger sees on a tablet while the car drives and they talk to it.

with Cabin() as cabin:
    print(cabin.url)
    cabin.tell(message)  # anything of driving.talk.messages.Said, from any thread; never waits
    told = cabin.take(0.05)  # Told, or sound as bytes, or None
"""

from chauffeur.hmi.cabin.server import Cabin as Cabin
from chauffeur.hmi.local_page import Certificate as Certificate

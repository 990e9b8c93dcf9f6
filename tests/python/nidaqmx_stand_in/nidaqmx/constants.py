import enum


class AcquisitionType(enum.Enum):
    FINITE = 10178
    CONTINUOUS = 10123

"""Node trees written as expressions: each call adds a node with its inputs, and may be an input of the next one."""

import bpy


class TreeBuilder:
    """Adds nodes to an empty node tree.

    A value of an input is a number, text or tuple, a socket, a node, which stands for the first output that it has in
    use, or for inputs that take several links a list of these.
    """

    def __init__(self, tree):
        self.tree = tree
        self.nodes = tree.nodes
        self._columns = {}

    def node(self, kind, *values, name="", **settings):
        """Add a node and return it.

        Parameters
        ----------
        kind : str
            Its `bl_idname`.
        *values
            Values of its inputs in use, in their order; None leaves one as it is.
        name : str
            Its name, for nodes that are read again.
        **settings
            Properties of the node, which begin in lower case, and values of other inputs by their names.
        """
        node = self.nodes.new(kind)
        if name:
            node.name = name
        self._columns[node.name] = 0
        for key, value in settings.items():
            if key[0].islower():
                _change(node, key, value)
        for socket, value in zip(_in_use(node.inputs), values, strict=False):
            self._fill(node, socket, value)
        for key, value in settings.items():
            if not key[0].islower():
                self._fill(node, next(socket for socket in _in_use(node.inputs) if socket.name == key), value)
        return node

    def math(self, operation, *values, name=""):
        """Add a node that calculates with numbers."""
        return self.node("ShaderNodeMath", *values, name=name, operation=operation)

    def vector(self, operation, *values):
        """Add a node that calculates with vectors."""
        return self.node("ShaderNodeVectorMath", *values, operation=operation)

    def switch(self, input_type, condition, off, on):
        """Add a node that chooses one of two values."""
        return self.node("GeometryNodeSwitch", condition, off, on, input_type=input_type)

    def attribute(self, name, data_type="FLOAT_VECTOR"):
        """Add a node that reads an attribute of the geometry."""
        return self.node("GeometryNodeInputNamedAttribute", name, data_type=data_type)

    def store(self, geometry, name, value, data_type="FLOAT_VECTOR"):
        """Add a node that stores an attribute of the geometry."""
        return self.node("GeometryNodeStoreNamedAttribute", geometry, Name=name, Value=value, data_type=data_type)

    def output(self, kind, *values):
        """Add the node that ends the tree, and place all nodes in columns, each to the right of its inputs."""
        self.node(kind, *values)
        rows, places = {}, []
        for node in self.nodes:
            column = self._columns[node.name]
            rows[column] = rows.get(column, 0) + 1
            places += 200.0 * column, -250.0 * rows[column]
        self.nodes.foreach_set("location", places)  # one by one each would update the whole tree

    def _fill(self, node, socket, value):
        for source in value if isinstance(value, list) else [value]:
            if isinstance(source, bpy.types.Node):
                source = next(_in_use(source.outputs))
            if isinstance(source, bpy.types.NodeSocket):
                self.tree.links.new(source, socket, verify_limits=False)  # there is none that it replaces
                self._columns[node.name] = max(self._columns[node.name], self._columns[source.node.name] + 1)
            elif source is not None:
                _change(socket, "default_value", source)


def _in_use(sockets):
    """Sockets that the properties of their node leave in use: of those of one name, the one of the node's data type."""
    return (socket for socket in sockets if socket.enabled)


def _change(data, name, value):
    """Set a property unless it has the value, for each change updates the whole tree."""
    if getattr(data, name) != value:
        setattr(data, name, value)

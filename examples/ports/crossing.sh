# A crossing whose lights are text: a car comes when the other road is green, and leaves when its own road is.
while read -r line; do
    case $line in
        '{"hello"'*) echo '{"hello": 1, "values": {"car": false}}' ;;
        '{"values"'* | '{"safe"'*)
            echo "$line" | sed 's/.*{\([^{}]*\)}.*/\1/; s/[":]//g' | tr A-Z a-z >&2
            case $line in
                *'"north": "GREEN"'*) echo '{"values": {"car": true}}' ;;
                *'"east": "GREEN"'*) echo '{"values": {"car": false}}' ;;
            esac
            ;;
    esac
done

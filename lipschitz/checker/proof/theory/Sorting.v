(** Sorting is 1-Lipschitz in the Euclidean norm and keeps sums: a comparison with a swap does, and sorting is made of
    them. *)
From Coq Require Import List Reals Lra Lia Psatz.
From Swarmcert Require Import Algebra Activations Form Network.
Import ListNotations.
Open Scope R_scope.

Notation insertedR := (inserted Rmin Rmax).
Notation ascendingR := (ascending Rmin Rmax).
Notation groupsR := (sorted_groups Rmin Rmax).

Lemma compare_and_swap a b c d :
  (Rmin a b - Rmin c d) * (Rmin a b - Rmin c d) + (Rmax a b - Rmax c d) * (Rmax a b - Rmax c d)
    <= (a - c) * (a - c) + (b - d) * (b - d).
Proof. unfold Rmin, Rmax. destruct (Rle_dec a b), (Rle_dec c d); nra. Qed.

Definition apart (u v : list R) : R := square (minus u v).
Lemma apart_nil : apart [] [] = 0. Proof. reflexivity. Qed.
Lemma apart_cons a u b v : apart (a :: u) (b :: v) = (a - b) * (a - b) + apart u v.
Proof. unfold apart, square, minus. simpl. ring. Qed.
Lemma apart_nonneg u v : 0 <= apart u v. Proof. apply square_nonneg. Qed.
Lemma apart_app u v w z : length u = length v -> apart (u ++ w) (v ++ z) = apart u v + apart w z.
Proof.
  revert v. induction u as [|a u IH]; intros [|b v]; simpl; try discriminate; intros H.
  - rewrite apart_nil. ring.
  - rewrite !apart_cons, IH by lia. ring.
Qed.

Lemma length_inserted a l : length (insertedR a l) = S (length l).
Proof. revert a. induction l as [|b l IH]; intros a; simpl; auto. Qed.
Lemma inserted_contracts a b u v : length u = length v ->
  apart (insertedR a u) (insertedR b v) <= (a - b) * (a - b) + apart u v.
Proof.
  revert a b v. induction u as [|c u IH]; intros a b [|d v]; simpl; try discriminate; intros H.
  - rewrite apart_cons. lra.
  - rewrite !apart_cons. specialize (IH (Rmax a c) (Rmax b d) v ltac:(lia)).
    pose proof (compare_and_swap a c b d). lra.
Qed.
Lemma length_ascending l : length (ascendingR l) = length l.
Proof. induction l as [|a l IH]; simpl; auto. unfold ascending in *. simpl. now rewrite length_inserted, IH. Qed.
Lemma ascending_contracts u v : length u = length v -> apart (ascendingR u) (ascendingR v) <= apart u v.
Proof.
  revert v. induction u as [|a u IH]; intros [|b v]; try discriminate; intros H; simpl in H; [simpl; lra|].
  rewrite apart_cons. change (ascendingR (a :: u)) with (insertedR a (ascendingR u)).
  change (ascendingR (b :: v)) with (insertedR b (ascendingR v)).
  pose proof (inserted_contracts a b (ascendingR u) (ascendingR v) ltac:(rewrite !length_ascending; lia)).
  specialize (IH v ltac:(lia)). lra.
Qed.
Lemma length_firstn_same (k : nat) (u v : list R) : length u = length v -> length (firstn k u) = length (firstn k v).
Proof. intros H. now rewrite !firstn_length, H. Qed.
Lemma length_skipn_same (k : nat) (u v : list R) : length u = length v -> length (skipn k u) = length (skipn k v).
Proof. intros H. now rewrite !skipn_length, H. Qed.
Lemma apart_split k u v : length u = length v ->
  apart u v = apart (firstn k u) (firstn k v) + apart (skipn k u) (skipn k v).
Proof. intros H. rewrite <- apart_app by now apply length_firstn_same. now rewrite !firstn_skipn. Qed.
Lemma groups_contract n k u v : length u = length v -> apart (groupsR n k u) (groupsR n k v) <= apart u v.
Proof.
  revert u v. induction n as [|n IH]; intros u v H; simpl; [rewrite apart_nil; apply apart_nonneg|].
  pose proof (length_firstn_same k u v H) as F. rewrite apart_app by now rewrite !length_ascending.
  rewrite (apart_split k u v H). pose proof (ascending_contracts _ _ F).
  specialize (IH _ _ (length_skipn_same k u v H)). lra.
Qed.

Lemma both_contract u u' v v' : length u = length u' -> length v = length v' ->
  apart (both Rmax u v) (both Rmax u' v') + apart (both Rmin u v) (both Rmin u' v') <= apart u u' + apart v v'.
Proof.
  revert u' v v'. induction u as [|a u IH]; intros [|b u'] v v' H G; simpl in H; try discriminate.
  - unfold both. simpl. rewrite apart_nil. pose proof (apart_nonneg v v'). lra.
  - destruct v as [|c v], v' as [|d v']; simpl in G; try discriminate.
    + unfold both. simpl. rewrite apart_cons, !apart_nil. pose proof (apart_nonneg u u').
      pose proof (Rle_0_sqr (a - b)) as Q. unfold Rsqr in Q. lra.
    + unfold both in *. simpl. rewrite !apart_cons. specialize (IH u' v v' ltac:(lia) ltac:(lia)).
      pose proof (compare_and_swap a c b d). lra.
Qed.
Lemma length_both f (u v : list R) : length (both f u v) = Nat.min (length u) (length v).
Proof. unfold both. now rewrite map_length, combine_length. Qed.
Lemma halves_contract u v : length u = length v ->
  apart (of_halves Rmax u ++ of_halves Rmin u) (of_halves Rmax v ++ of_halves Rmin v) <= apart u v.
Proof.
  intros H. unfold of_halves. rewrite <- H. set (h := Nat.div2 (length u)).
  pose proof (length_firstn_same h u v H) as F. pose proof (length_skipn_same h u v H) as G.
  rewrite apart_app by now rewrite !length_both, F, G. rewrite (apart_split h u v H). now apply both_contract.
Qed.
Lemma pairs_contract n : forall u v, (length u <= n)%nat -> length u = length v ->
  length (of_pairs Rmax u) = length (of_pairs Rmax v) /\
  apart (of_pairs Rmax u) (of_pairs Rmax v) + apart (of_pairs Rmin u) (of_pairs Rmin v) <= apart u v.
Proof.
  induction n as [|n IH]; intros [|a [|b u]] [|c [|d v]]; simpl; try discriminate; intros L H; try lia.
  - rewrite !apart_nil. split; [auto|lra].
  - rewrite !apart_nil. split; [auto|lra].
  - split; auto. rewrite apart_cons, !apart_nil.
    pose proof (Rle_0_sqr (a - c)) as Q. unfold Rsqr in Q. lra.
  - destruct (IH u v ltac:(lia) ltac:(lia)) as [E I]. split; [lia|]. rewrite !apart_cons.
    pose proof (compare_and_swap a b c d). lra.
Qed.

Theorem sorting_contracts s u v : length u = length v ->
  square (minus (sort_layer s u) (sort_layer s v)) <= square (minus u v).
Proof.
  intros H. change (apart (sort_layer s u) (sort_layer s v) <= apart u v). destruct s; simpl.
  - rewrite <- H. now apply groups_contract.
  - now apply halves_contract.
  - destruct (pairs_contract (length u) u v (le_n _) H) as [E I]. now rewrite apart_app.
Qed.

(** Group by group *)
Lemma total_app u v : total (u ++ v) = total u + total v.
Proof. induction u as [|a u IH]; simpl; [ring|]. rewrite IH. ring. Qed.
Lemma total_inserted a l : total (insertedR a l) = a + total l.
Proof.
  revert a. induction l as [|b l IH]; intros a; simpl; auto. rewrite IH. unfold Rmin, Rmax.
    destruct (Rle_dec a b); ring.
Qed.
Lemma total_ascending l : total (ascendingR l) = total l.
Proof.
  induction l as [|a l IH]; auto. change (ascendingR (a :: l)) with (insertedR a (ascendingR l)).
  now rewrite total_inserted, IH.
Qed.
Lemma total_minus u v : length u = length v -> total (minus u v) = total u - total v.
Proof.
  unfold minus. revert v. induction u as [|a u IH]; intros [|b v]; simpl; try discriminate; intros; [ring|].
  rewrite IH by lia. ring.
Qed.
Lemma minus_app u v w z : length u = length v -> minus (u ++ w) (v ++ z) = minus u v ++ minus w z.
Proof. unfold minus. revert v. induction u as [|a u IH]; intros [|b v]; simpl; try discriminate; intros; auto.
  now rewrite IH by lia. Qed.
Lemma firstn_exactly {T} k (u v : list T) : length u = k -> firstn k (u ++ v) = u.
Proof. intros <-. rewrite firstn_app, Nat.sub_diag, firstn_all. apply app_nil_r. Qed.
Lemma skipn_exactly {T} k (u v : list T) : length u = k -> skipn k (u ++ v) = v.
Proof. intros <-. now rewrite skipn_app, Nat.sub_diag, skipn_all. Qed.
Lemma minus_split k u v : length u = length v ->
  minus u v = minus (firstn k u) (firstn k v) ++ minus (skipn k u) (skipn k v).
Proof.
  intros H. rewrite <- minus_app by now apply length_firstn_same. now rewrite !firstn_skipn.
Qed.
Lemma length_groups n k u : length u = (n * k)%nat -> length (groupsR n k u) = (n * k)%nat.
Proof.
  revert u. induction n as [|n IH]; intros u; simpl; intros H; auto.
  rewrite app_length, length_ascending, firstn_length, IH; [lia|]. rewrite skipn_length. lia.
Qed.
Theorem groups_keep_sums n k u v : length u = (n * k)%nat -> length v = (n * k)%nat ->
  groups_within n k (minus u v) (minus (groupsR n k u) (groupsR n k v)).
Proof.
  revert u v. induction n as [|n IH]; intros u v Hu Hv; simpl in Hu, Hv.
  - destruct u, v; try discriminate. now split.
  - assert (length (firstn k u) = k) as Fu by (rewrite firstn_length; lia).
    assert (length (firstn k v) = k) as Fv by (rewrite firstn_length; lia).
    rewrite (minus_split k u v) by congruence. cbn [sorted_groups].
    rewrite minus_app by (rewrite !length_ascending; congruence).
    set (a := minus (firstn k u) (firstn k v)). set (b := minus (ascendingR _) (ascendingR _)).
    assert (length a = k) as La by (unfold a; rewrite length_minus; congruence).
    assert (length b = k) as Lb by (unfold b; rewrite length_minus; rewrite !length_ascending; congruence).
    cbn [groups_within]. rewrite !firstn_exactly, !skipn_exactly by auto. repeat split; auto.
    + apply ascending_contracts. congruence.
    + unfold a, b. rewrite !total_minus by (rewrite ?length_ascending; congruence). now rewrite !total_ascending.
    + apply IH; rewrite skipn_length; lia.
Qed.
Lemma groups_of_none n k : groupsR n k [] = [].
Proof. induction n as [|n IH]; simpl; auto. now rewrite firstn_nil, skipn_nil, IH. Qed.
Lemma sort_groups n k u : length u = (n * k)%nat -> sort_layer (Groups k) u = groupsR n k u.
Proof.
  unfold sort_layer. cbn [sorted_by]. intros H. assert (k = O \/ (n <= length u)%nat) as [->|L] by (destruct k; nia).
  - rewrite Nat.mul_0_r in H. destruct u; [|discriminate]. now rewrite !groups_of_none.
  - replace (length u) with (n + (length u - n))%nat by lia. generalize (length u - n)%nat as extra. clear L.
    revert u H. induction n as [|n IH]; intros u H extra; simpl in *.
    + destruct u; [|discriminate]. apply groups_of_none.
    + rewrite IH; auto. rewrite skipn_length. lia.
Qed.
